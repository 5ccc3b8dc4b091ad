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
#include "bindings/trajectory.h"
#include "spartan/eval/disparity_metrics.h"
#include "spartan/eval/trajectory_metrics.h"
#include "spartan/report/report.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

TrajectoryMetricsOptions metrics_options(const std::string& align, const std::optional<std::vector<double>>& segments,
                                         bool kitti, double max_dt_s) {
  TrajectoryMetricsOptions options;
  const auto alignment = alignment_named(align);
  if (!alignment) throw nb::value_error("align: must be 'none', 'first', 'yaw', 'se3' or 'sim3'");
  options.alignment = *alignment;
  options.max_dt_s = max_dt_s;
  if (segments) options.segment_lengths_m = *segments;
  return kitti ? with_kitti_segments(options) : options;
}

TrajectoryMetrics evaluate(const TrajectoryValue& estimate, const TrajectoryValue& truth, const std::string& align,
                           const std::optional<std::vector<double>>& segments, bool kitti, double max_dt_s) {
  const TrajectoryMetricsOptions options = metrics_options(align, segments, kitti, max_dt_s);
  const nb::gil_scoped_release free;
  return value_of(compare_trajectories(estimate.poses, truth.poses, options));
}

TrajectoryMetrics evaluate_files(const PathText& estimate, const PathText& truth, const std::string& align,
                                 const std::optional<std::vector<double>>& segments, bool kitti, double max_dt_s,
                                 const std::string& kind) {
  const TrajectoryMetricsOptions options = metrics_options(align, segments, kitti, max_dt_s);
  const nb::gil_scoped_release free;
  const ComparedTrajectories compared = value_of(find_trajectories(estimate, truth, kind));
  return value_of(compare_trajectories(compared.estimate, compared.truth, options));
}

void bind_trajectory_metrics(nb::module_& m) {
  nb::class_<ErrorStatistics>(m, "ErrorStatistics", "Statistics of the errors of all poses.")
      .def_ro("rmse", &ErrorStatistics::rmse)
      .def_ro("mean", &ErrorStatistics::mean)
      .def_ro("median", &ErrorStatistics::median)
      .def_ro("max", &ErrorStatistics::max)
      .def("__repr__", [](const ErrorStatistics& s) {
        return fmt::format("<rmse {:.4g}, mean {:.4g}, median {:.4g}, max {:.4g}>", s.rmse, s.mean, s.median, s.max);
      });
  nb::class_<SegmentErrors>(m, "SegmentErrors", "Mean errors over all segments of one length.")
      .def_ro("length_m", &SegmentErrors::length_m)
      .def_ro("count", &SegmentErrors::count)
      .def_ro("translation_percent", &SegmentErrors::translation_percent)
      .def_ro("rotation_deg_per_m", &SegmentErrors::rotation_deg_per_m);
  nb::class_<TrajectoryMetrics>(m, "TrajectoryMetrics", "Errors of a trajectory against the truth.")
      .def_ro("frames", &TrajectoryMetrics::frames, "Number of associated poses.")
      .def_ro("path_length_m", &TrajectoryMetrics::path_length_m)
      .def_ro("ate_m", &TrajectoryMetrics::ate_m, "Absolute trajectory error, m.")
      .def_ro("drift_percent", &TrajectoryMetrics::drift_percent,
              "Error of the last position, percent of the path length.")
      .def_ro("rpe_translation_m", &TrajectoryMetrics::rpe_translation_m)
      .def_ro("rpe_rotation_deg", &TrajectoryMetrics::rpe_rotation_deg)
      .def_ro("segments", &TrajectoryMetrics::segments)
      .def_prop_ro(
          "missing",
          [](const TrajectoryMetrics& t) {
            nb::dict reasons;
            for (const MissingMetric& each : t.missing) reasons[each.name.c_str()] = each.reason;
            return reasons;
          },
          nb::sig("def missing(self) -> dict[str, str]"), "Metrics that could not be computed, and why.")
      .def("__repr__", [](const TrajectoryMetrics& t) {
        return fmt::format("<TrajectoryMetrics of {} poses: ATE {:.4f} m, drift {}>", t.frames, t.ate_m.rmse,
                           t.drift_percent ? fmt::format("{:.3f} %", *t.drift_percent) : "unknown");
      });
  m.def("evaluate_trajectory", evaluate, "estimate"_a, "truth"_a, nb::kw_only(), "align"_a = "se3",
        "segments_m"_a = nb::none(), "kitti"_a = false, "max_dt_s"_a = 0.02,
        "Compares two trajectories, poses as world_from_body of the same body frame. `align`: what is fitted before: "
        "`none`, "
        "`first`, `yaw`, `se3` or `sim3`. `kitti`: segments of 100 to 800 m.");
  m.def("evaluate_run", evaluate_files, "estimate"_a, "truth"_a, nb::kw_only(), "align"_a = "se3",
        "segments_m"_a = nb::none(), "kitti"_a = false, "max_dt_s"_a = 0.02, "kind"_a = "",
        "The same of a run folder or a trajectory file and of a trajectory file or a recording with truth, as `spartan "
        "evaluate`; `kind`: the trajectory of the run, the best without it.");
}

void bind_disparity_metrics(nb::module_& m) {
  nb::class_<DisparityScores>(m, "DisparityScores", "Scores over the pixels of one kind; None over no pixels.")
      .def_ro("truth_pixels", &DisparityScores::truth_pixels)
      .def_ro("matched_pixels", &DisparityScores::matched_pixels)
      .def_ro("bad_0_5", &DisparityScores::bad_0_5,
              "Percent of the truth pixels with an error above 0.5 px; holes are bad.")
      .def_ro("bad_1", &DisparityScores::bad_1)
      .def_ro("bad_2", &DisparityScores::bad_2)
      .def_ro("bad_3", &DisparityScores::bad_3)
      .def_ro("matched_bad_1", &DisparityScores::matched_bad_1, "Percent of the matched pixels.")
      .def_ro("matched_bad_2", &DisparityScores::matched_bad_2)
      .def_ro("density_percent", &DisparityScores::density_percent)
      .def_ro("rms_in_1px", &DisparityScores::rms_in_1px, "RMS error of the pixels with an error up to 1 px, px.")
      .def_ro("mean_abs_px", &DisparityScores::mean_abs_px);
  nb::class_<DisparityMetrics>(m, "DisparityMetrics", "Errors of a disparity image against the truth.")
      .def_ro("all", &DisparityMetrics::all)
      .def_ro("nonocc", &DisparityMetrics::nonocc, "Pixels that both cameras see; None without a mask.");
  m.def(
      "evaluate_disparity",
      [](const AnyArray& estimate, const AnyArray& truth, const std::optional<AnyArray>& mask) {
        return value_of(
            compare_disparities(image_view<float>(estimate, "estimate"), image_view<float>(truth, "truth"),
                                mask ? image_view<std::uint8_t>(*mask, "mask") : ImageView<const std::uint8_t>()));
      },
      "estimate"_a, "truth"_a, "mask"_a = nb::none(),
      "Compares disparities (float32, px, NaN where unknown). `mask`: 255 seen by both cameras, 128 occluded, 0 no "
      "truth.");
  m.def(
      "read_disparity",
      [](const PathText& path, double scale) { return owned_array(value_of(read_disparity(path, scale))); }, "path"_a,
      "scale_of_8_bit"_a = 1.0,
      "Reads disparities in px, NaN where unknown: PFM, 16-bit PNG (value / 256), 8-bit PNG (value / scale).");
}

}  // namespace

void bind_evaluation(nb::module_& m) {
  bind_trajectory_metrics(m);
  bind_disparity_metrics(m);
}

}  // namespace spartan::python
