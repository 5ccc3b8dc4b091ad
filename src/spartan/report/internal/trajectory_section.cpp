#include "spartan/report/internal/trajectory_section.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/trajectory.h"
#include "spartan/eval/trajectory_metrics.h"
#include "spartan/report/internal/page_parts.h"
#include "spartan/report/report.h"
#include "spartan/system/run_folder.h"

namespace spartan::internal {
namespace {

constexpr Rgb8 kTruthColour{196, 78, 0}, kOutsideColour{250, 160, 160};
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

struct Kind {
  TrajectoryKind kind;
  Rgb8 colour;
};
constexpr std::array<Kind, 3> kKinds{{{TrajectoryKind::odometry, {31, 95, 168}},
                                      {TrajectoryKind::slam, {122, 63, 157}},
                                      {TrajectoryKind::localization, {28, 122, 66}}}};

const StampedPose& nearest(const Trajectory& truth, Stamp stamp) {
  const auto after =
      std::lower_bound(truth.begin(), truth.end(), stamp, [](const StampedPose& p, Stamp s) { return p.stamp < s; });
  if (after == truth.begin()) return truth.front();
  const auto before = std::prev(after);
  return after == truth.end() || stamp.ns - before->stamp.ns <= after->stamp.ns - stamp.ns ? *before : *after;
}

// 3σ of the position along the axis of largest variance.
double three_sigma(const Matrix6d& covariance) {
  const Eigen::Matrix3d position = covariance.topLeftCorner<3, 3>();
  return 3 * std::sqrt(std::max(0.0, position.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff()));
}

// Projection to the ground. KITTI's world frame is that of the first left camera: x right, z forward.
Eigen::Vector2d on_ground(const Eigen::Vector3d& p, PoseConvention convention) {
  return convention == PoseConvention::left_optical ? Eigen::Vector2d(p.z(), -p.x()) : Eigen::Vector2d(p.x(), p.y());
}

PlotLine track(const Trajectory& trajectory, const Pose& world_from, PoseConvention convention, const std::string& name,
               Rgb8 colour) {
  PlotLine line{name, colour, {}, {}};
  for (const StampedPose& p : trajectory) {
    const Eigen::Vector2d at = on_ground(world_from * p.pose.translation(), convention);
    line.x.push_back(at.x());
    line.y.push_back(at.y());
  }
  return line;
}

// The poses of the truth between the first and the last of the estimate.
Trajectory while_estimated(const Trajectory& truth, const Trajectory& estimate) {
  if (estimate.empty()) return {};
  const double margin_s = TrajectoryMetricsOptions().max_dt_s;
  Trajectory cut;
  for (const StampedPose& p : truth) {
    if (seconds_between(p.stamp, estimate.front().stamp) <= margin_s &&
        seconds_between(estimate.back().stamp, p.stamp) <= margin_s)
      cut.push_back(p);
  }
  return cut;
}

// Errors and bounds of one trajectory, in metres, over the distance driven; NaN where unknown.
struct ErrorSeries {
  std::string name;
  Rgb8 colour;
  std::vector<double> distance_m, error_m, bound_m;
};

ErrorSeries errors_of(const Kind& kind, const ComparedTrajectories& compared, const Pose& truth_from_estimate,
                      const std::vector<FrameRecord>& frames) {
  ErrorSeries series{std::string(name_of(kind.kind)), kind.colour, {}, {}, {}};
  double driven = 0;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  auto frame = frames.begin();
  for (const StampedPose& p : compared.estimate) {
    const Eigen::Vector3d at = truth_from_estimate * p.pose.translation();
    driven += series.distance_m.empty() ? 0 : (at - before).norm();
    before = at;
    const StampedPose& truth = nearest(compared.truth, p.stamp);
    const bool known = std::abs(seconds_between(truth.stamp, p.stamp)) <= TrajectoryMetricsOptions().max_dt_s;
    while (frame != frames.end() && frame->stamp < p.stamp) ++frame;
    const auto pose = frame != frames.end() && frame->stamp == p.stamp ? pose_of(*frame, kind.kind) : std::nullopt;
    series.distance_m.push_back(driven);
    series.error_m.push_back(known ? (at - truth.pose.translation()).norm() : kNone);
    series.bound_m.push_back(pose ? three_sigma(pose->covariance) : kNone);
  }
  return series;
}

// Where the error is larger than its bound; NaN elsewhere.
std::vector<double> outside(const ErrorSeries& s) {
  std::vector<double> values;
  for (std::size_t i = 0; i < s.error_m.size(); ++i)
    values.push_back(s.error_m[i] > s.bound_m[i] ? s.error_m[i] : kNone);
  return values;
}

std::string consistency_text(const ErrorSeries& s) {
  int compared = 0, beyond = 0;
  double first_m = 0, most = 0;
  for (std::size_t i = 0; i < s.error_m.size(); ++i) {
    if (!std::isfinite(s.error_m[i]) || !std::isfinite(s.bound_m[i])) continue;
    ++compared;
    if (!(s.error_m[i] > s.bound_m[i])) continue;
    if (beyond++ == 0) first_m = s.distance_m[i];
    if (s.bound_m[i] > 0) most = std::max(most, s.error_m[i] / s.bound_m[i]);
  }
  if (compared == 0) return "";
  if (beyond == 0)
    return fmt::format("<p>{}: the error stays within its 3σ in all {} frames compared.</p>\n", s.name, compared);
  return fmt::format(
      "<p class=\"warning\">{}: the error leaves its 3σ in {} of {} frames ({:.1f} %), first after {:.2f} m, by up to "
      "{:.1f} times 3σ. There the stated uncertainty is too small, or the true attitude of the first pose, to which "
      "all is "
      "aligned, is inaccurate.</p>\n",
      s.name, beyond, compared, 100.0 * beyond / compared, first_m, most);
}

std::vector<double> scaled(std::vector<double> values, double factor) {
  for (double& v : values) v *= factor;
  return values;
}

Plot error_plot(const std::vector<ErrorSeries>& all, const std::string& aligned) {
  double most = 0;
  for (const ErrorSeries& s : all) {
    for (const auto* values : {&s.error_m, &s.bound_m}) {
      for (const double value : *values) most = std::max(most, std::isfinite(value) ? value : 0.0);
    }
  }
  const double factor = most < 1 ? 1000 : 1;
  Plot plot;
  const auto has_bound = [](const ErrorSeries& s) {
    return std::any_of(s.bound_m.begin(), s.bound_m.end(), [](double b) { return std::isfinite(b); });
  };
  const bool bounded = std::any_of(all.begin(), all.end(), has_bound);
  plot.title = (bounded ? "Position error and 3σ, " : "Position error, ") + aligned;
  plot.x_label = "distance driven, m";
  plot.y_label = most < 1 ? "position error, mm" : "position error, m";
  for (const ErrorSeries& s : all) {
    const std::vector<double> beyond = outside(s);
    if (std::any_of(beyond.begin(), beyond.end(), [](double b) { return std::isfinite(b); }))
      plot.lines.push_back({s.name + ", outside 3σ", kOutsideColour, s.distance_m, scaled(beyond, factor), 8});
    plot.lines.push_back({s.name, s.colour, s.distance_m, scaled(s.error_m, factor)});
    if (has_bound(s))
      plot.lines.push_back({s.name + ", 3σ", s.colour, s.distance_m, scaled(s.bound_m, factor), 1.5, 5});
  }
  return plot;
}

Result<TrajectoryMetrics> metrics_since_start(const ComparedTrajectories& compared) {
  TrajectoryMetricsOptions options;
  options.alignment = Alignment::first;
  auto metrics = compare_trajectories(compared.estimate, compared.truth, options);
  if (metrics || metrics.error().code != ErrorCode::usage) return metrics;
  options.alignment = Alignment::se3;  // the truth has no rotation
  return compare_trajectories(compared.estimate, compared.truth, options);
}

std::string alignment_text(Alignment alignment) {
  return alignment == Alignment::first ? "first poses aligned" : "SE3 alignment";
}

// What the trajectories are drawn on: the global map, if there is one.
Plot ground_of(std::optional<Plot> map, bool heading_east) {
  const bool on_map = map.has_value();
  Plot plot = on_map ? std::move(*map) : Plot();
  plot.title = on_map ? "Trajectories on the global map" : "Trajectories from above";
  plot.equal_axes = true;
  name_world_axes(plot, heading_east);
  plot.width_px = 740;
  plot.height_px = 560;
  plot.shown_px = 1040;
  return plot;
}

}  // namespace

Result<std::string> trajectory_section(TrajectorySectionInput input) {
  const auto rig = read_rig_yaml(RunFolder{input.run}.rig());
  if (!rig) return failure(rig);
  Plot tracks = ground_of(std::move(input.map), input.heading_east);
  std::vector<ErrorSeries> errors;
  Alignment alignment = Alignment::first;
  for (const Kind& kind : kKinds) {
    if (!has_trajectory(input.frames, kind.kind)) continue;
    const Trajectory poses = trajectory_of(input.frames, kind.kind);
    if (poses.empty()) continue;
    tracks.lines.push_back(track(poses, Pose(), PoseConvention::body, std::string(name_of(kind.kind)), kind.colour));
    tracks.markers = {rover_marker("rover at the end", poses.back().pose)};
    if (input.truth.empty()) continue;
    const auto compared = find_trajectories(input.run, input.truth, std::string(name_of(kind.kind)));
    if (!compared) return failure(compared);
    if (compared->estimate.empty() || compared->truth.empty()) continue;
    const auto metrics = metrics_since_start(*compared);
    if (!metrics) return failure(metrics);
    const Pose& truth_from_estimate = metrics->truth_from_estimate.pose;
    alignment = metrics->alignment;
    if (errors.empty()) {
      tracks.lines.insert(tracks.lines.begin(),
                          track(while_estimated(compared->truth, compared->estimate), truth_from_estimate.inverse(),
                                rig->convention, "truth", kTruthColour));
    }
    ErrorSeries series = errors_of(kind, *compared, truth_from_estimate, input.frames);
    // A fit to the whole trajectory says nothing of what accumulates since the start.
    if (alignment != Alignment::first) std::fill(series.bound_m.begin(), series.bound_m.end(), kNone);
    errors.push_back(std::move(series));
  }
  std::string html = to_html(tracks);
  if (errors.empty()) return html;
  html += to_html(error_plot(errors, alignment_text(alignment)));
  for (const ErrorSeries& s : errors) html += consistency_text(s);
  return html + fmt::format("<p>Truth and errors in these plots: {}. {}</p>\n", alignment_text(alignment),
                            alignment == Alignment::first
                                ? "The covariances are relative to the start."
                                : "The truth has no attitude: errors since the start, and their 3σ, need one.");
}

}  // namespace spartan::internal
