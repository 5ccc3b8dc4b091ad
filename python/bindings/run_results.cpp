// What a run folder contains.
#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/path_text.h"
#include "bindings/recordings.h"
#include "bindings/threads.h"
#include "bindings/trajectory.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_options.h"
#include "spartan/system/run_store.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

// The records of a run, read when it was opened.
struct RunResults {
  RunFolder folder;
  std::vector<FrameRecord> frames;
  std::vector<MapRecord> maps;
  std::vector<TerrainRecord> terrain;
};

RunResults open_results(const PathText& path) {
  const nb::gil_scoped_release free;
  RunResults results{{path}, {}, {}, {}};
  RunStore store = value_of(RunStore::open_read_only(results.folder.store()));
  results.frames = value_of(store.frames());
  results.maps = value_of(store.maps());
  results.terrain = value_of(store.terrain());
  return results;
}

TrajectoryKind kind_of(const RunResults& run, const std::optional<std::string>& name) {
  if (!name) {
    for (const TrajectoryKind kind : kTrajectoriesBestFirst) {
      if (has_trajectory(run.frames, kind)) return kind;
    }
    return TrajectoryKind::odometry;
  }
  const auto kind = parse_trajectory_kind(*name);
  if (!kind) throw nb::value_error("kind: must be 'odometry', 'slam', 'localization' or 'smoothed'");
  if (!has_trajectory(run.frames, *kind))
    throw RaisedError(Error{ErrorCode::input, "the run has no trajectory '" + *name + "'", run.folder.path, {}});
  return *kind;
}

std::vector<std::string> kinds(const RunResults& run) {
  std::vector<std::string> names;
  for (const TrajectoryKind kind : kTrajectories) {
    if (has_trajectory(run.frames, kind)) names.emplace_back(name_of(kind));
  }
  return names;
}

nb::ndarray<nb::numpy, double, nb::shape<-1, 6, 6>> covariances(const RunResults& run,
                                                                const std::optional<std::string>& name) {
  const TrajectoryKind kind = kind_of(run, name);
  const auto [values, owner] = kept_by_python(std::vector<double>());
  for (const FrameRecord& frame : run.frames) {
    if (const auto pose = pose_of(frame, kind))
      values->insert(values->end(), pose->covariance.data(), pose->covariance.data() + 36);  // symmetric
  }
  return {values->data(), {values->size() / 36, 6, 6}, owner};
}

void export_to(const RunResults& run, const std::string& format, const PathText& path,
               const std::optional<std::string>& trajectory, std::optional<int> threads, RecordingValue* recording) {
  const ExportFormat chosen = value_of(parse_export_format(format));
  const std::optional<TrajectoryKind> kind = trajectory ? std::optional(kind_of(run, trajectory)) : std::nullopt;
  const ThreadPool workers = thread_pool(threads);
  if (chosen == ExportFormat::colmap && recording != nullptr) {
    return recording->stream.use([&](auto& stream) {
      static_cast<void>(value_of(export_colmap(run.folder.path, *stream, kind, workers, path)));
    });
  }
  const nb::gil_scoped_release free;
  check(export_run(run.folder.path, chosen, kind, workers, path));
}

nb::dict sensors(const FrameRecord& frame) {
  nb::dict states;
  if (!frame.localization) return states;
  for (const auto& sensor : frame.localization->sensors)
    states[sensor.name.c_str()] = nb::make_tuple(sensor.state, sensor.reason);
  return states;
}

nb::dict innovations(const FrameRecord& frame) {
  nb::dict tests;
  if (!frame.localization) return tests;
  for (const auto& sensor : frame.localization->sensors) {
    if (sensor.test) tests[sensor.name.c_str()] = nb::cast(*sensor.test);
  }
  return tests;
}

nb::dict times(const FrameRecord& frame) {
  nb::dict milliseconds;
  for (const StageTime& time : frame.times) milliseconds[time.stage.c_str()] = time.wall_ms;
  return milliseconds;
}

void bind_records(nb::module_& m) {
  nb::class_<FrameRecord>(m, "FrameRecord",
                          "A frame that was processed, or one that the recording lists and that is missing.")
      .def_ro("frame_id", &FrameRecord::frame_id)
      .def_ro("pair", &FrameRecord::pair)
      .def_prop_ro("stamp_ns", [](const FrameRecord& f) { return f.stamp.ns; })
      .def_ro("status", &FrameRecord::status,
              "Of the odometry: `tracking`, `degraded`, `lost`, `stationary`, or `missing`.")
      .def_ro("fault", &FrameRecord::fault, "Why the frame or one of its images is missing; empty otherwise.")
      .def_ro("message", &FrameRecord::message)
      .def_ro("has_pose", &FrameRecord::has_pose, "False: the pose of the odometry is predicted.")
      .def_ro("odometry", &FrameRecord::world_from_body, "world_from_body, UncertainPose")
      .def_ro("motion", &FrameRecord::motion)
      .def_ro("slam", &FrameRecord::slam, "world_from_body, UncertainPose; None where it is missing.")
      .def_prop_ro(
          "localization",
          [](const FrameRecord& f) {
            return f.localization ? std::optional(f.localization->world_from_body) : std::nullopt;
          },
          "world_from_body, UncertainPose; None where it is missing.")
      .def_ro("smoothed", &FrameRecord::smoothed, "world_from_body, UncertainPose; None before the end of the run.")
      .def_prop_ro("sensors", sensors, nb::sig("def sensors(self) -> dict[str, tuple[str, str]]"),
                   "State and reason of each sensor of the localization.")
      .def_prop_ro("innovations", innovations, nb::sig("def innovations(self) -> dict[str, InnovationTest]"),
                   "The last test since the frame before, of each sensor of the localization that was tested.")
      .def_ro("latency_ms", &FrameRecord::latency_ms,
              "Of a live run: from the arrival of the images to the pose; None of a recording.")
      .def_prop_ro("times_ms", times, nb::sig("def times_ms(self) -> dict[str, float]"), "Wall time of each stage, ms.")
      .def("__repr__", [](const FrameRecord& f) {
        return fmt::format("<FrameRecord {} at {} s: {}>", f.frame_id, to_decimal_seconds(f.stamp), f.status);
      });
  nb::class_<MapRecord>(m, "MapRecord", "The local map of a stop or keyframe.")
      .def_prop_ro("stamp_ns", [](const MapRecord& r) { return r.stamp.ns; })
      .def_ro("position_id", &MapRecord::position_id)
      .def_ro("views", &MapRecord::views)
      .def_ro("prior", &MapRecord::prior, "world_from_body before map matching.")
      .def_ro("world_from_body", &MapRecord::world_from_body, "After map matching.")
      .def_ro("match", &MapRecord::status, "`decided` where the map determined the pose, else why not.")
      .def_ro("overlap", &MapRecord::overlap)
      .def_ro("known_cells", &MapRecord::known_cells)
      .def_ro("obstacles", &MapRecord::obstacles);
}

}  // namespace

void bind_run_results(nb::module_& m) {
  bind_records(m);
  nb::class_<RunResults>(m, "RunResults", "The records of a run folder; see spartan.Run.")
      .def(
          "__init__", [](RunResults* self, const PathText& path) { new (self) RunResults(open_results(path)); },
          "path"_a)
      .def_prop_ro("path", [](const RunResults& r) { return r.folder.path; })
      .def_prop_ro(
          "frames", [](RunResults& r) { return nb::cast(r.frames); }, nb::sig("def frames(self) -> list[FrameRecord]"))
      .def_prop_ro(
          "stops", [](RunResults& r) { return nb::cast(r.maps); }, nb::sig("def stops(self) -> list[MapRecord]"))
      .def_prop_ro("terrain_stamps_ns",
                   [](const RunResults& r) {
                     std::vector<std::int64_t> stamps;
                     stamps.reserve(r.terrain.size());
                     for (const TerrainRecord& t : r.terrain) stamps.push_back(t.stamp.ns);
                     return stamps;
                   })
      .def_prop_ro("rig", [](const RunResults& r) { return value_of(read_rig_yaml(r.folder.rig())); })
      .def_prop_ro("options", [](const RunResults& r) { return value_of(load_options<RunOptions>(r.folder.config())); })
      .def_prop_ro("trajectories", kinds)
      .def(
          "trajectory",
          [](const RunResults& r, const std::optional<std::string>& name) {
            return TrajectoryValue{trajectory_of(r.frames, kind_of(r, name))};
          },
          "kind"_a = nb::none())
      .def("covariances", covariances, "kind"_a = nb::none())
      .def("export", export_to, "format"_a, "path"_a, "trajectory"_a = nb::none(), "threads"_a = nb::none(),
           "recording"_a.none() = nb::none());
}

}  // namespace spartan::python
