#include "spartan/report/internal/trajectory_section.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <vector>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/trajectory.h"
#include "spartan/report/internal/html_parts.h"
#include "spartan/report/report.h"
#include "spartan/system/run_folder.h"

namespace spartan::internal {
namespace {

struct Kind {
  TrajectoryKind kind;
  const char* colour;
  const char* pale;  // of its 3σ
};
constexpr std::array<Kind, 3> kKinds{{{TrajectoryKind::odometry, "#1f5fa8", "#a9c4e2"},
                                      {TrajectoryKind::slam, "#7a3f9d", "#d0b8de"},
                                      {TrajectoryKind::localization, "#2c8a4a", "#aed6b9"}}};

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
struct Ground {
  PoseConvention convention = PoseConvention::body;
  Eigen::Vector2d place(const Eigen::Vector3d& p) const {
    return convention == PoseConvention::left_optical ? Eigen::Vector2d(p.z(), -p.x()) : Eigen::Vector2d(p.x(), p.y());
  }
};

PlotLine ground_track(const Trajectory& trajectory, const Ground& ground, const std::string& name, const char* colour) {
  PlotLine line{name, colour, {}, {}};
  for (const StampedPose& p : trajectory) {
    const Eigen::Vector2d at = ground.place(p.pose.translation());
    line.x.push_back(at.x());
    line.y.push_back(at.y());
  }
  return line;
}

struct Lines {
  std::vector<PlotLine> way, errors;
};

void draw(const Kind& kind, const ComparedTrajectories& compared, const Pose& truth_from_estimate,
          const std::vector<FrameRecord>& frames, const Ground& ground, Lines& lines) {
  const std::string name(name_of(kind.kind));
  PlotLine way{name, kind.colour, {}, {}}, error{name, kind.colour, {}, {}}, band{name + ", 3σ", kind.pale, {}, {}};
  double driven = 0;
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  auto frame = frames.begin();
  for (const StampedPose& p : compared.estimate) {
    const Eigen::Vector3d at = truth_from_estimate * p.pose.translation();
    driven += way.x.empty() ? 0 : (at - before).norm();
    before = at;
    const Eigen::Vector2d from_above = ground.place(at);
    way.x.push_back(from_above.x());
    way.y.push_back(from_above.y());
    const StampedPose& truth = nearest(compared.truth, p.stamp);
    if (std::abs(seconds_between(truth.stamp, p.stamp)) <= TrajectoryMetricsOptions().max_dt_s) {
      error.x.push_back(driven);
      error.y.push_back(1000 * (at - truth.pose.translation()).norm());
    }
    while (frame != frames.end() && frame->stamp < p.stamp) ++frame;
    if (frame == frames.end() || frame->stamp != p.stamp) continue;
    if (const auto pose = pose_of(*frame, kind.kind)) {
      band.x.push_back(driven);
      band.y.push_back(1000 * three_sigma(pose->covariance));
    }
  }
  lines.way.push_back(std::move(way));
  if (!band.x.empty()) lines.errors.push_back(std::move(band));
  lines.errors.push_back(std::move(error));
}

}  // namespace

Result<TrajectoryMetrics> errors_of(const ComparedTrajectories& compared) {
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

Result<std::string> trajectory_plots(const std::string& run, const std::vector<FrameRecord>& frames,
                                     const std::string& truth) {
  const auto rig = read_rig_yaml(RunFolder{run}.rig());
  if (!rig) return failure(rig);
  const Ground ground{truth.empty() ? PoseConvention::body : rig->convention};
  Lines lines;
  std::string aligned;
  for (const Kind& kind : kKinds) {
    if (!has_trajectory(frames, kind.kind)) continue;
    if (truth.empty()) {
      lines.way.push_back(
          ground_track(trajectory_of(frames, kind.kind), ground, std::string(name_of(kind.kind)), kind.colour));
      continue;
    }
    const auto compared = find_trajectories(run, truth, std::string(name_of(kind.kind)));
    if (!compared) return failure(compared);
    if (lines.way.empty()) lines.way.push_back(ground_track(compared->truth, ground, "truth", "#9a3b12"));
    if (compared->estimate.empty() || compared->truth.empty()) continue;
    const auto metrics = errors_of(*compared);
    if (!metrics) return failure(metrics);
    draw(kind, *compared, metrics->truth_from_estimate.pose, frames, ground, lines);
    aligned = alignment_text(metrics->alignment);
  }
  std::string html = svg_plot(lines.way, {"x, m", "y, m", true, 560, 420});
  if (lines.errors.empty()) return html;
  html += svg_plot(lines.errors, {"distance, m", "position error, " + aligned + ", mm", false, 560, 420});
  return html + "<p>Position errors here, and of the best trajectory at the top of the page: " + aligned + ".</p>\n";
}

}  // namespace spartan::internal
