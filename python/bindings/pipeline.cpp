#include "spartan/system/pipeline.h"

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/guarded.h"
#include "bindings/map_layers.h"
#include "bindings/path_text.h"
#include "bindings/threads.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

// With the options by which it makes its maps.
class PipelineValue : public Guarded<Pipeline> {
 public:
  PipelineValue(Pipeline pipeline, const MapOptions& maps) : Guarded(std::move(pipeline)), maps_(maps) {}
  const MapOptions& maps() const { return maps_; }

 private:
  MapOptions maps_;
};

void bind_results(nb::module_& m) {
  nb::class_<TerrainView>(m, "TerrainView", "Dense disparity of one frame with its pose.")
      .def_ro("pair", &TerrainView::pair)
      .def_prop_ro("stamp_ns", [](const TerrainView& v) { return v.stamp.ns; })
      .def_ro("geometry", &TerrainView::geometry)
      .def_ro("world_from_left", &TerrainView::world_from_left, "Pose of the rectified left optical frame.")
      .def_prop_ro(
          "left", [](const nb::handle& self) { return member_array(self, &TerrainView::left); },
          nb::sig("def left(self) -> numpy.typing.NDArray[numpy.uint8]"), "The rectified left image.")
      .def_prop_ro(
          "disparity", [](const nb::handle& self) { return member_array(self, &TerrainView::disparity); },
          nb::sig("def disparity(self) -> numpy.typing.NDArray[numpy.float32]"), "Pixels; NaN where unknown.")
      .def_prop_ro(
          "sigma", [](const nb::handle& self) { return member_array(self, &TerrainView::sigma); },
          nb::sig("def sigma(self) -> numpy.typing.NDArray[numpy.float32]"), "Standard deviation, px.");
  nb::class_<MappedStop>(m, "MappedStop", "A stop or keyframe whose map was applied.")
      .def_ro("position_id", &MappedStop::position_id, "-1: a keyframe.")
      .def_prop_ro("stamp_ns", [](const MappedStop& s) { return s.stamp.ns; })
      .def_ro("views", &MappedStop::views)
      .def_ro("prior", &MappedStop::prior, "world_from_body before map matching.")
      .def_prop_ro(
          "world_from_body", [](const MappedStop& s) { return s.merged.corrected; }, "After map matching.")
      .def_prop_ro(
          "match", [](const MappedStop& s) { return std::string(name_of(s.merged.match.status)); },
          "`decided` where the map determined the pose, else why not.");
  nb::class_<FrameResult>(m, "FrameResult", "Result of one frame of the odometry's pair.")
      .def_ro("frame_id", &FrameResult::frame_id)
      .def_prop_ro("stamp_ns", [](const FrameResult& r) { return r.stamp.ns; })
      .def_ro("world_from_body", &FrameResult::world_from_body, "UncertainPose by the odometry alone.")
      .def_ro("motion", &FrameResult::motion, "MotionEstimate since the frame before.")
      .def_ro("slam", &FrameResult::slam, "UncertainPose: odometry corrected by map matching; None without maps.")
      .def_ro("localization", &FrameResult::localization, "LocalizationEstimate by all sensors; None without it.")
      .def_prop_ro(
          "terrain", [](FrameResult& r) { return r.terrain ? &*r.terrain : nullptr; },
          nb::rv_policy::reference_internal, nb::sig("def terrain(self) -> TerrainView | None"),
          "A dense view of an earlier frame, where there is one now.")
      .def_prop_ro(
          "stop", [](FrameResult& r) { return r.stop ? &*r.stop : nullptr; }, nb::rv_policy::reference_internal,
          nb::sig("def stop(self) -> MappedStop | None"), "An earlier stop or keyframe whose map was applied now.")
      .def("__repr__", [](const FrameResult& r) {
        const auto& t = r.world_from_body.pose.translation();
        return fmt::format("<FrameResult {}: {}, {:.3f}, {:.3f}, {:.3f} m>", r.frame_id, name_of(r.motion.status),
                           t.x(), t.y(), t.z());
      });
}

template <class SensorSample>
void add_sensor(PipelineValue& self, const SensorSample& sample) {
  self.use([&](Pipeline& pipeline) { pipeline.add(sample); });
}

std::optional<FrameResult> add_frame(PipelineValue& self, const StereoFrame& frame) {
  return self.use([&](Pipeline& pipeline) { return value_of(pipeline.add(frame)); });
}

}  // namespace

void bind_pipeline(nb::module_& m) {
  bind_results(m);
  nb::class_<PipelineValue>(
      m, "Pipeline",
      "All stages from stereo frames and sensor samples to poses, terrain and maps in one object. One "
      "pipeline per rover; samples are added in order of time.")
      .def(
          "__init__",
          [](PipelineValue* self, const Rig& rig, const RunOptions* options, std::optional<int> threads, bool live,
             const PathText& masks) {
            const RunOptions chosen = options == nullptr ? RunOptions() : *options;
            const ThreadPool workers = thread_pool(threads);
            const nb::gil_scoped_release free;
            Pipeline made = value_of(Pipeline::create(rig, chosen, workers, masks, live ? Pace::live : Pace::recorded));
            new (self) PipelineValue(std::move(made), resolved_options(chosen, rig).mapping.map);
          },
          "rig"_a, "options"_a.none() = nb::none(), nb::kw_only(), "threads"_a = nb::none(), "live"_a = false,
          "mask_folder"_a = "",
          "`live`: no frame waits for maps and terrain; else they enter at stated frames, so that results do not "
          "depend on "
          "time. Raises Error where rig or options are invalid.")
      .def("add", add_frame, "frame"_a,
           "Processes a frame. Frames of the odometry's pair have a FrameResult; frames of other pairs are views of "
           "the stop "
           "whose position_id they carry and give None. Raises Error with the code `frame_rejected` where the images "
           "do not "
           "fit; the next frame may be added.")
      .def("add", add_sensor<ImuSample>, "sample"_a, "Adds a sample of a sensor.")
      .def("add", add_sensor<WheelSample>, "sample"_a)
      .def("add", add_sensor<CompassSample>, "sample"_a)
      .def("add", add_sensor<InclinometerSample>, "sample"_a)
      .def(
          "add", [](PipelineValue&, const MissingFrame&) { return nb::none(); }, "missing"_a, "Does nothing.")
      .def(
          "align_with_gravity",
          [](PipelineValue& self, const std::vector<ImuSample>& samples) {
            self.use([&](Pipeline& pipeline) { pipeline.align_with_gravity(samples); });
          },
          "stationary_samples"_a,
          "Before the first frame: the vertical by samples of a rover at rest that are not added themselves.")
      .def(
          "align_with_ground",
          [](PipelineValue& self, const NumberArray& up) {
            const Eigen::Vector3d axis = vector_of<3>(up, "up_in_body");
            if (!axis.allFinite() || axis.norm() < 1e-6) throw nb::value_error("up_in_body: has no direction");
            self.use([&](Pipeline& pipeline) { pipeline.align_with_ground(axis.normalized()); });
          },
          "up_in_body"_a, "Before the first frame: the vertical where no sensor measures it.")
      .def(
          "estimate", [](PipelineValue& self) { return self.use([](Pipeline& p) { return p.estimate(); }); },
          "LocalizationEstimate at the newest sample; None before the first frame.")
      .def(
          "estimate_at",
          [](PipelineValue& self, std::int64_t stamp) {
            return self.use([&](Pipeline& p) { return p.estimate_at(Stamp{stamp}); });
          },
          "stamp_ns"_a, "The same at a time that the localization holds.")
      .def(
          "finish_stop",
          [](PipelineValue& self) { return self.use([](Pipeline& p) { return value_of(p.finish_stop()); }); },
          "At the end of a drive: applies the map of a stop that is not applied yet. To be called until it returns "
          "None.")
      .def(
          "finish_terrain",
          [](PipelineValue& self) { return self.use([](Pipeline& p) { return p.finish_terrain(); }); },
          "At the end of a drive: the TerrainView that was to be delivered with a later frame; None where there is "
          "none.")
      .def(
          "map_view",
          [](PipelineValue& self) -> std::unique_ptr<MapViewValue> {
            return self.use([&](Pipeline& p) -> std::unique_ptr<MapViewValue> {
              GlobalMap& map = p.global_map();
              if (map.empty()) return nullptr;
              MapView seen = value_of(map.view(map.extent()));
              Traversability shape = seen.shape(self.maps(), ThreadPool(1));
              return std::make_unique<MapViewValue>(std::move(seen), std::move(shape));
            });
          },
          nb::sig("def map_view(self) -> MapView | None"), "The global map so far; None while it is empty.")
      .def_prop_ro(
          "odometry_pair", [](PipelineValue& self) { return self.use([](Pipeline& p) { return p.odometry_pair(); }); },
          "Name of the pair that drives the odometry.");
}

}  // namespace spartan::python
