#include "spartan/eval/trajectory_metrics.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "spartan/core/pose.h"
#include "spartan/eval/internal/association.h"

namespace spartan {

using namespace internal;

namespace {

bool has_rotation(const Trajectory& trajectory) {
  return std::any_of(trajectory.begin(), trajectory.end(),
                     [](const StampedPose& entry) { return rotation_angle(entry.pose) > 1e-9; });
}

Status check(const TrajectoryMetricsOptions& options, bool truth_has_rotation) {
  const auto positive = [](double length) { return std::isfinite(length) && length > 0; };
  if (!std::all_of(options.segment_lengths_m.begin(), options.segment_lengths_m.end(), positive)) {
    return failure(ErrorCode::usage, "segment lengths must be positive");
  }
  if (options.segment_step < 1 || options.rpe_delta_frames < 1 || !(options.max_dt_s >= 0)) {
    return failure(ErrorCode::usage, "steps in frames must be at least 1, and the maximum time difference at least 0");
  }
  if (options.alignment == Alignment::first && !truth_has_rotation) {
    return failure(ErrorCode::usage, "the truth has no rotation, so the alignment `first` is not possible", {},
                   "use yaw, se3 or sim3");
  }
  return {};
}

Trajectory transformed(const Similarity& similarity, Trajectory trajectory) {
  for (StampedPose& entry : trajectory) entry.pose = similarity * entry.pose;
  return trajectory;
}

// (Q_i⁻¹ Q_j)⁻¹ (P_i⁻¹ P_j)
Pose relative_error(const Trajectory& estimate, const Trajectory& truth, std::size_t i, std::size_t j) {
  const Pose true_motion = truth[i].pose.inverse() * truth[j].pose;
  return true_motion.inverse() * (estimate[i].pose.inverse() * estimate[j].pose);
}

ErrorStatistics absolute_errors(const Trajectory& estimate, const Trajectory& truth) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    errors.push_back((estimate[i].pose.translation() - truth[i].pose.translation()).norm());
  }
  return statistics_of(std::move(errors));
}

// Path length up to every frame, metres.
std::vector<double> path_lengths(const Trajectory& truth) {
  std::vector<double> lengths{0.0};
  for (std::size_t i = 1; i < truth.size(); ++i) {
    lengths.push_back(lengths.back() + (truth[i].pose.translation() - truth[i - 1].pose.translation()).norm());
  }
  return lengths;
}

SegmentErrors segment_errors(const Trajectory& estimate, const Trajectory& truth, const std::vector<double>& path_m,
                             double length_m, std::size_t step) {
  SegmentErrors errors{length_m, 0, std::nullopt, std::nullopt};
  double translation = 0, rotation = 0;
  for (std::size_t i = 0; i < truth.size(); i += step) {
    const auto end =
        std::lower_bound(path_m.begin() + static_cast<std::ptrdiff_t>(i), path_m.end(), path_m[i] + length_m);
    if (end == path_m.end()) break;
    const Pose error = relative_error(estimate, truth, i, static_cast<std::size_t>(end - path_m.begin()));
    translation += error.translation().norm() / length_m;
    rotation += rotation_angle(error) / length_m;
    ++errors.count;
  }
  if (errors.count > 0) {
    errors.translation_percent = 100.0 * translation / errors.count;
    errors.rotation_deg_per_m = kDegreesPerRadian * rotation / errors.count;
  }
  return errors;
}

void add_relative_errors(TrajectoryMetrics& metrics, const Trajectory& estimate, const Trajectory& truth,
                         bool truth_has_rotation) {
  std::vector<double> translations, rotations;
  const auto delta = static_cast<std::size_t>(metrics.rpe_delta_frames);
  for (std::size_t i = 0; i + delta < truth.size(); ++i) {
    if (truth_has_rotation) {
      const Pose error = relative_error(estimate, truth, i, i + delta);
      translations.push_back(error.translation().norm());
      rotations.push_back(kDegreesPerRadian * rotation_angle(error));
    } else {
      const auto displacement = [&](const Trajectory& t) -> Eigen::Vector3d {
        return t[i + delta].pose.translation() - t[i].pose.translation();
      };
      translations.push_back((displacement(estimate) - displacement(truth)).norm());
    }
  }
  if (!translations.empty()) metrics.rpe_translation_m = statistics_of(std::move(translations));
  if (!rotations.empty()) metrics.rpe_rotation_deg = statistics_of(std::move(rotations));
}

constexpr double kLeastMotionForDrift_m = 0.5;

double farthest_from_start(const Trajectory& truth) {
  double farthest = 0;
  for (const StampedPose& entry : truth)
    farthest = std::max(farthest, (entry.pose.translation() - truth.front().pose.translation()).norm());
  return farthest;
}

constexpr double kMotionsOfPath = 20;
constexpr double kLeastAxesRotation_deg = 20, kMostUnexplained = 0.1;

// Motions in body axes over equal parts of the path: u of the estimate, v of the truth. With the same axes u = v; with
// axes that differ by a rotation R, v = R u.
std::optional<double> axes_rotation_deg(const Trajectory& estimate, const Trajectory& truth,
                                        const std::vector<double>& path_m) {
  std::vector<Eigen::Vector3d> of_estimate, of_truth;
  for (std::size_t i = 0, j = 0; j < path_m.size(); ++j) {
    if (path_m[j] - path_m[i] < path_m.back() / kMotionsOfPath || path_m.back() == 0) continue;
    of_estimate.push_back((estimate[i].pose.inverse() * estimate[j].pose).translation());
    of_truth.push_back((truth[i].pose.inverse() * truth[j].pose).translation());
    i = j;
  }
  if (of_truth.size() < 3) return std::nullopt;
  // Each motion and its opposite: the fit is then a rotation alone.
  for (std::vector<Eigen::Vector3d>* motions : {&of_estimate, &of_truth}) {
    const std::size_t count = motions->size();
    for (std::size_t i = 0; i < count; ++i) motions->push_back(-(*motions)[i]);
  }
  const Eigen::Matrix3d rotation = fit_similarity(of_estimate, of_truth, false).pose.rotation_matrix();
  double unexplained = 0, same_axes = 0, all = 0;
  for (std::size_t i = 0; i < of_truth.size(); ++i) {
    unexplained += (of_truth[i] - rotation * of_estimate[i]).squaredNorm();
    same_axes += (of_truth[i] - of_estimate[i]).squaredNorm();
    all += of_truth[i].squaredNorm();
  }
  // Motions along a line leave the rotation about it free; then this is the angle between the lines.
  const double angle_deg = 2 * std::asin(std::min(1.0, 0.5 * std::sqrt(same_axes / all))) * 180 / std::numbers::pi;
  const bool explained = unexplained < kMostUnexplained * kMostUnexplained * all;
  return explained && angle_deg > kLeastAxesRotation_deg ? std::optional(angle_deg) : std::nullopt;
}

void explain_missing(TrajectoryMetrics& metrics, bool truth_has_rotation) {
  const std::string too_few = "fewer frames than the step of the relative error";
  const std::string no_rotation = "the truth has no rotation (all are the identity)";
  const auto explain = [&](bool there, const char* name, const std::string& reason) {
    if (!there) metrics.missing.push_back({name, reason});
  };
  explain(metrics.rpe_translation_m.has_value(), "rpe.translation_m", too_few);
  explain(metrics.rpe_rotation_deg.has_value(), "rpe.rotation_deg", truth_has_rotation ? too_few : no_rotation);
  explain(metrics.segments.has_value(), "segments", no_rotation);
  explain(metrics.drift_percent.has_value(), "drift_percent",
          truth_has_rotation ? "the truth stays within 0.5 m of its start" : no_rotation);
  explain(metrics.ate_first_rmse_m.has_value(), "ate_first_rmse_m", no_rotation);
}

}  // namespace

ErrorStatistics statistics_of(std::vector<double> errors) {
  if (errors.empty()) throw std::invalid_argument("statistics_of: no errors");
  const auto count = static_cast<double>(errors.size());
  ErrorStatistics result;
  double squares = 0;
  for (const double error : errors) {
    result.mean += error / count;
    squares += error * error / count;
  }
  result.rmse = std::sqrt(squares);
  std::sort(errors.begin(), errors.end());
  const std::size_t half = errors.size() / 2;
  result.median = errors.size() % 2 == 1 ? errors[half] : 0.5 * (errors[half - 1] + errors[half]);
  result.max = errors.back();
  return result;
}

TrajectoryMetricsOptions with_kitti_segments(TrajectoryMetricsOptions options) {
  options.segment_lengths_m = {100, 200, 300, 400, 500, 600, 700, 800};
  options.segment_step = 10;
  return options;
}

Result<TrajectoryMetrics> compare_trajectories(const Trajectory& estimate, const Trajectory& truth,
                                               const TrajectoryMetricsOptions& options) {
  const bool truth_has_rotation = has_rotation(truth);
  if (const Status status = check(options, truth_has_rotation); !status) return failure(status);
  const auto pairs = associate(estimate, truth, options.max_dt_s);
  if (!pairs) return failure(pairs);

  TrajectoryMetrics metrics;
  metrics.alignment = options.alignment;
  metrics.rpe_delta_frames = options.rpe_delta_frames;
  metrics.truth_from_estimate = align(pairs->estimate, pairs->truth, options.alignment);
  metrics.frames = pairs->truth.size();
  const std::vector<double> path_m = path_lengths(pairs->truth);
  metrics.path_length_m = path_m.back();

  const Trajectory aligned = transformed(metrics.truth_from_estimate, pairs->estimate);
  metrics.ate_m = absolute_errors(aligned, pairs->truth);
  add_relative_errors(metrics, aligned, pairs->truth, truth_has_rotation);
  if (truth_has_rotation) {
    const auto step = static_cast<std::size_t>(options.segment_step);
    metrics.segments.emplace();
    for (const double length : options.segment_lengths_m) {
      metrics.segments->push_back(segment_errors(aligned, pairs->truth, path_m, length, step));
    }
    metrics.ate_first_rmse_m =
        absolute_errors(transformed(align(pairs->estimate, pairs->truth, Alignment::first), pairs->estimate),
                        pairs->truth)
            .rmse;
    if (farthest_from_start(pairs->truth) >= kLeastMotionForDrift_m) {
      const Pose error = relative_error(pairs->estimate, pairs->truth, 0, metrics.frames - 1);
      metrics.drift_percent = 100.0 * error.translation().norm() / metrics.path_length_m;
    }
    metrics.axes_rotation_deg = axes_rotation_deg(pairs->estimate, pairs->truth, path_m);
  }
  explain_missing(metrics, truth_has_rotation);
  return metrics;
}

}  // namespace spartan
