#include "program/trajectory_report.h"

#include <fmt/format.h>

#include <filesystem>

#include "spartan/system/run_folder.h"

namespace spartan::program {
namespace {

Json statistics_to_json(const std::optional<ErrorStatistics>& errors) {
  if (!errors) return nullptr;
  return {{"rmse", number(errors->rmse)},
          {"mean", number(errors->mean)},
          {"median", number(errors->median)},
          {"max", number(errors->max)}};
}

Json segments_to_json(const std::optional<std::vector<SegmentErrors>>& segments) {
  if (!segments) return nullptr;
  Json list = Json::array();
  for (const SegmentErrors& segment : *segments) {
    Json entry{{"length_m", segment.length_m},
               {"count", segment.count},
               {"translation_percent", number(segment.translation_percent)},
               {"rotation_deg_per_m", number(segment.rotation_deg_per_m)}};
    if (segment.count == 0) entry["reason"] = "the path is shorter";
    list.push_back(std::move(entry));
  }
  return list;
}

Json normalized_to_json(const NormalizedErrors& errors) {
  return {{"count", errors.count}, {"mean", number(errors.mean)}, {"median", number(errors.median)}};
}

Json consistency_to_json(const std::optional<MotionConsistency>& consistency) {
  if (!consistency) return nullptr;
  Json segments = Json::array();
  for (const NormalizedErrors& segment : consistency->segments) {
    Json entry = normalized_to_json(segment);
    entry["length_m"] = segment.length_m;
    segments.push_back(std::move(entry));
  }
  return {{"motions", normalized_to_json(consistency->motions)}, {"segments", std::move(segments)}};
}

Json similarity_to_json(const Similarity& similarity) {
  const auto& t = similarity.pose.translation();
  const auto& q = similarity.pose.rotation();
  return {{"scale", number(similarity.scale)},
          {"translation_m", {number(t.x()), number(t.y()), number(t.z())}},
          {"rotation_xyzw", {number(q.x()), number(q.y()), number(q.z()), number(q.w())}}};
}

std::string line_of(const std::string& name, const std::optional<ErrorStatistics>& e) {
  if (!e) return fmt::format("{:<30}{:>10}\n", name, "-");
  return fmt::format("{:<30}{:>10.4f}{:>10.4f}{:>10.4f}{:>10.4f}\n", name, e->rmse, e->mean, e->median, e->max);
}

std::string table_of(const MotionConsistency& consistency) {
  std::string text = fmt::format("\n{:<20}{:>10}{:>17}{:>17}\n", "NEES (6 expected)", "count", "mean", "median");
  const auto add_line = [&](const std::string& name, const NormalizedErrors& errors) {
    if (errors.count > 0)
      text += fmt::format("{:<20}{:>10}{:>17.2f}{:>17.2f}\n", name, errors.count, *errors.mean, *errors.median);
  };
  add_line("frame to frame", consistency.motions);
  for (const NormalizedErrors& segment : consistency.segments)
    add_line(fmt::format("{:g} m", segment.length_m), segment);
  return text;
}

}  // namespace

Result<TrajectoryScores> score(const ComparedTrajectories& compared, const TrajectoryMetricsOptions& options) {
  auto metrics = compare_trajectories(compared.estimate, compared.truth, options);
  if (!metrics) return failure(metrics);
  TrajectoryScores scores{std::move(*metrics), std::nullopt};
  const RunFolder run{std::filesystem::path(compared.estimate_path).parent_path().string()};
  std::error_code error;
  if (compared.kind != name_of(TrajectoryKind::odometry) || !std::filesystem::exists(run.store(), error)) {
    scores.metrics.missing.push_back({"nees", "only of the odometry of a run folder"});
    return scores;
  }
  auto consistency = motion_consistency(run.path, compared.truth, options.max_dt_s, options.segment_lengths_m);
  if (consistency) {
    scores.consistency = std::move(*consistency);
  } else {
    scores.metrics.missing.push_back({"nees", consistency.error().message()});
  }
  return scores;
}

Json to_json(const TrajectoryScores& scores, const ComparedTrajectories& compared) {
  const TrajectoryMetrics& metrics = scores.metrics;
  Json reasons = Json::object();
  for (const MissingMetric& missing : metrics.missing) reasons[missing.name] = missing.reason;
  return {{"schema", 1},
          {"align", std::string(name_of(metrics.alignment))},
          {"trajectory", compared.kind},
          {"estimate", compared.estimate_path},
          {"truth", compared.truth_path},
          {"frames", metrics.frames},
          {"path_length_m", number(metrics.path_length_m)},
          {"ate_m", statistics_to_json(std::optional(metrics.ate_m))},
          {"ate_first_rmse_m", number(metrics.ate_first_rmse_m)},
          {"drift_percent", number(metrics.drift_percent)},
          {"segments", segments_to_json(metrics.segments)},
          {"rpe",
           {{"translation_m", statistics_to_json(metrics.rpe_translation_m)},
            {"rotation_deg", statistics_to_json(metrics.rpe_rotation_deg)},
            {"delta_frames", metrics.rpe_delta_frames}}},
          {"nees", consistency_to_json(scores.consistency)},
          {"truth_from_estimate", similarity_to_json(metrics.truth_from_estimate)},
          {"axes_rotation_deg", number(metrics.axes_rotation_deg)},
          {"reasons", std::move(reasons)}};
}

std::string table_of(const TrajectoryScores& scores, const ComparedTrajectories& compared) {
  const TrajectoryMetrics& metrics = scores.metrics;
  std::string text = fmt::format("estimate  {}{}\ntruth     {}\n", compared.estimate_path,
                                 compared.kind == "file" ? "" : " (" + compared.kind + ")", compared.truth_path);
  text += fmt::format("frames    {} of {} compared over {:.2f} m\n", metrics.frames, compared.estimate.size(),
                      metrics.path_length_m);
  text += fmt::format(
      "aligned   {}{}\n\n", name_of(metrics.alignment),
      metrics.alignment == Alignment::sim3 ? fmt::format(", scale {:.5f}", metrics.truth_from_estimate.scale) : "");
  text += fmt::format("{:<30}{:>10}{:>10}{:>10}{:>10}\n", "error", "rmse", "mean", "median", "max");
  text += line_of("ATE, m", metrics.ate_m);
  if (metrics.ate_first_rmse_m && metrics.alignment != Alignment::first)
    text += fmt::format("{:<30}{:>10.4f}\n", "ATE, first poses aligned, m", *metrics.ate_first_rmse_m);
  const std::string delta =
      metrics.rpe_delta_frames == 1 ? "1 frame" : fmt::format("{} frames", metrics.rpe_delta_frames);
  text += line_of("RPE translation (" + delta + "), m", metrics.rpe_translation_m);
  text += line_of("RPE rotation (" + delta + "), deg", metrics.rpe_rotation_deg);
  if (metrics.drift_percent) text += fmt::format("\nend-point drift, %{:>12.3f}\n", *metrics.drift_percent);
  if (metrics.segments) {
    text += fmt::format("\n{:<20}{:>10}{:>17}{:>17}\n", "segments, m", "count", "translation, %", "rotation, deg/m");
    for (const SegmentErrors& s : *metrics.segments) {
      if (s.count == 0) continue;
      text += fmt::format("{:<20g}{:>10}{:>17.3f}{:>17.5f}\n", s.length_m, s.count, *s.translation_percent,
                          *s.rotation_deg_per_m);
    }
  }
  if (scores.consistency) text += table_of(*scores.consistency);
  if (metrics.axes_rotation_deg) {
    text += fmt::format(
        "\nnote: the body axes of the trajectories differ by a constant rotation, {:.0f} deg for the motions (x "
        "forward "
        "against z forward, of a camera?): only the ATE compares them; RPE, segments and drift need a truth of the "
        "same "
        "axes\n",
        *metrics.axes_rotation_deg);
  }
  for (const MissingMetric& missing : metrics.missing) {
    if (missing.name != "nees" || compared.kind == name_of(TrajectoryKind::odometry))
      text += fmt::format("no {}: {}\n", missing.name, missing.reason);
  }
  return text;
}

}  // namespace spartan::program
