#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "spartan/slam/internal/map_refinement.h"
#include "spartan/slam/internal/match_covariance.h"
#include "spartan/slam/internal/scan_matching.h"
#include "spartan/slam/map_merger.h"

namespace spartan {

using namespace internal;

namespace {

constexpr double kDownsampling = 0.25;  // grid size for downsampling the points, in cell sizes
// Candidates are the same pose within 1 cm and 5 mrad (empirical), or within 99.9 % of χ² with 6 degrees of freedom.
constexpr double kSame_m = 0.01, kSame_rad = 0.005, kSameSquare = 22.5;

struct Candidate {
  RefinedMatch match;
  MatchCost cost;
};

// Whether two candidates differ by no more than the uncertainty of the best one.
bool same_pose(const Pose& best, const Pose& other, const MatchCovariance& covariance) {
  const Pose d = best.inverse() * other;
  if (d.translation().norm() < kSame_m && rotation_angle(d) < kSame_rad) return true;
  Vector6d tangent;
  tangent << other.translation() - best.translation(), log_so3(other.rotation() * best.rotation().conjugate());
  return covariance.determined == 6 && tangent.dot(covariance.information * tangent) < kSameSquare;
}

// Whether a pose lies outside of the search window by more than half a step.
bool outside(const Pose& from, const Pose& to, const SearchWindow& window, const MatchOptions& options) {
  const Eigen::Vector3d moved = to.translation() - from.translation(),
                        turned = log_so3(to.rotation() * from.rotation().conjugate());
  return std::abs(moved.x()) > window.x_m + 0.5 * options.step_m ||
         std::abs(moved.y()) > window.y_m + 0.5 * options.step_m ||
         std::abs(turned.z()) > window.yaw_rad + 0.5 * options.step_deg * std::numbers::pi / 180;
}

// Information of a world tangent (t, θ) about the body as that of the right perturbation of the pose.
Matrix6d in_body(const Matrix6d& world_information, const Pose& world_from_body) {
  Matrix6d rotation = Matrix6d::Zero();
  rotation.topLeftCorner<3, 3>() = rotation.bottomRightCorner<3, 3>() = world_from_body.rotation_matrix();
  const Matrix6d rotated = rotation.transpose() * world_information * rotation;
  return 0.5 * (rotated + rotated.transpose());
}

}  // namespace

std::string_view name_of(MatchStatus status) {
  switch (status) {
    case MatchStatus::decided:
      return "decided";
    case MatchStatus::no_overlap:
      return "no_overlap";
    case MatchStatus::flat:
      return "flat";
    case MatchStatus::ambiguous:
      return "ambiguous";
    case MatchStatus::high_residual:
      return "misfit";
    default:
      return "at_edge";
  }
}

MapMatch match_map(std::span<const SurfacePoint> points, const LocalMap& local, const MapView& global,
                   const UncertainPose& world_from_body, int min_points, const MatchOptions& options,
                   const ThreadPool& workers) {
  MapMatch result;
  result.world_from_body = world_from_body.pose;
  const SurfaceGrid local_grid = grid_of(local), global_grid = global.grid();
  const Eigen::Vector3d centre = world_from_body.pose.translation();
  const SearchWindow window = search_window(world_from_body, options);
  std::vector<ScanMatchPeak> peaks =
      correlative_scan_match(coarser(local_grid), coarser(global_grid), centre, window, options, workers);
  if (static_cast<int>(peaks.size()) > options.candidates) peaks.resize(static_cast<std::size_t>(options.candidates));

  const std::vector<SurfacePoint> sampled = downsampled(points, kDownsampling * global.cell_m);
  std::vector<std::optional<RefinedMatch>> refined(peaks.size());
  workers.parallel_for(0, static_cast<int>(peaks.size()), 1, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Pose start = peaks[k].correction * world_from_body.pose;
      refined[k] = refine_match(sampled, global_grid, start, min_points, options);
    }
  });
  double scale = std::numeric_limits<double>::infinity();
  // All candidates are scored with the residual scale of the one that fits best.
  for (const auto& match : refined) scale = match ? std::min(scale, match->normalized_residual) : scale;
  std::vector<Candidate> candidates;
  for (auto& match : refined) {
    if (!match) continue;
    const MatchCost cost = cost_of(match->cells, global.cell_m, std::max(scale, 0.1), options);
    candidates.push_back({std::move(*match), cost});
  }
  result.candidates = static_cast<int>(candidates.size());
  if (candidates.empty()) return result;
  const Candidate& best = *std::min_element(candidates.begin(), candidates.end(),
                                            [](const auto& a, const auto& b) { return a.cost.mean < b.cost.mean; });
  const MatchCovariance covariance = estimate_match_covariance(best.match.cells, global.cell_m, options);
  result.margin = std::numeric_limits<double>::infinity();
  for (const Candidate& other : candidates) {
    if (same_pose(best.match.world_from_body, other.match.world_from_body, covariance)) continue;
    const double margin =
        (other.cost.mean - best.cost.mean) / std::sqrt(std::max(other.cost.variance + best.cost.variance, 1e-300));
    result.margin = std::min(result.margin, margin);
  }

  result.world_from_body = best.match.world_from_body;
  result.cells = covariance.cells;
  result.blocks = covariance.blocks;
  result.overlap = static_cast<double>(covariance.cells) / std::max(best.match.known_cells, 1);
  result.normalized_residual = covariance.normalized_residual;
  result.determined = covariance.determined;
  result.sigma_m = covariance.sigma_m;
  result.sigma_rad = covariance.sigma_rad;
  if (covariance.blocks < options.min_blocks) {
    result.status = MatchStatus::no_overlap;
  } else if (outside(world_from_body.pose, result.world_from_body, window, options)) {
    result.status = MatchStatus::at_edge;
  } else if (covariance.normalized_residual > options.max_normalized_residual) {
    result.status = MatchStatus::high_residual;
  } else if (covariance.determined < 6) {
    result.status = MatchStatus::flat;
  } else if (result.margin < options.min_margin_sigmas) {
    result.status = MatchStatus::ambiguous;
  } else {
    result.status = MatchStatus::decided;
  }
  if (result.status == MatchStatus::decided || result.status == MatchStatus::flat)
    result.information = in_body(covariance.information, result.world_from_body);
  return result;
}

}  // namespace spartan
