#include "spartan/slam/map_matcher.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "spartan/slam/jitter_search.h"
#include "spartan/slam/map_refinement.h"
#include "spartan/slam/match_evidence.h"

namespace spartan {
namespace {

constexpr double kThinned = 0.25;  // of a cell's side
constexpr double kSame_m = 0.01, kSame_rad = 0.005, kSameSquare = 22.5;

struct Candidate {
  RefinedMatch match;
  MatchCost cost;
};

// Two answers that differ by no more than the best one's own uncertainty (99.9 % of χ² with 6 degrees of freedom).
bool same_place(const Pose& best, const Pose& other, const MatchEvidence& evidence) {
  const Pose d = best.inverse() * other;
  if (d.translation().norm() < kSame_m && rotation_angle(d) < kSame_rad) return true;
  Vector6d tangent;
  tangent << other.translation() - best.translation(), log_so3(other.rotation() * best.rotation().conjugate());
  return evidence.determined == 6 && tangent.dot(evidence.information * tangent) < kSameSquare;
}

// Outside of what was searched, with one step's grace.
bool outside(const Pose& from, const Pose& to, const SearchWindow& window, const MatchOptions& options) {
  const Eigen::Vector3d moved = to.translation() - from.translation(),
                        turned = log_so3(to.rotation() * from.rotation().conjugate());
  return std::abs(moved.x()) > window.x_m + 0.5 * options.step_m ||
         std::abs(moved.y()) > window.y_m + 0.5 * options.step_m ||
         std::abs(turned.z()) > window.yaw_rad + 0.5 * options.step_deg * std::numbers::pi / 180;
}

Matrix6d in_body(const Matrix6d& world_information, const Pose& world_from_body) {
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = world_from_body.rotation_matrix();
  const Matrix6d turned = turn.transpose() * world_information * turn;
  return 0.5 * (turned + turned.transpose());
}

}  // namespace

std::string_view name_of(MatchVerdict verdict) {
  switch (verdict) {
    case MatchVerdict::decided:
      return "decided";
    case MatchVerdict::no_overlap:
      return "no_overlap";
    case MatchVerdict::flat:
      return "flat";
    case MatchVerdict::ambiguous:
      return "ambiguous";
    case MatchVerdict::misfit:
      return "misfit";
    default:
      return "at_edge";
  }
}

MapMatch match_map(std::span<const SurfacePoint> points, const LocalMap& local, const MapView& global,
                   const UncertainPose& world_from_body, int fewest_points, const MatchOptions& options,
                   const Workers& workers) {
  MapMatch result;
  result.world_from_body = world_from_body.pose;
  const SurfaceGrid ours = grid_of(local), theirs = global.grid();
  const Eigen::Vector3d centre = world_from_body.pose.translation();
  const SearchWindow window = search_window(world_from_body, options);
  std::vector<JitterPeak> peaks = jitter_search(coarser(ours), coarser(theirs), centre, window, options, workers);
  if (static_cast<int>(peaks.size()) > options.peaks) peaks.resize(static_cast<std::size_t>(options.peaks));

  const std::vector<SurfacePoint> few = thinned(points, kThinned * global.cell_m);
  std::vector<std::optional<RefinedMatch>> refined(peaks.size());
  workers.for_each_part(0, static_cast<int>(peaks.size()), 1, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Pose start = peaks[k].correction * world_from_body.pose;
      refined[k] = refine_match(few, theirs, start, fewest_points, options);
    }
  });
  double scale = std::numeric_limits<double>::infinity();
  for (const auto& match : refined) scale = match ? std::min(scale, match->misfit) : scale;
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
  const MatchEvidence evidence = weigh(best.match.cells, global.cell_m, options);
  result.lead = std::numeric_limits<double>::infinity();
  for (const Candidate& other : candidates) {
    if (same_place(best.match.world_from_body, other.match.world_from_body, evidence)) continue;
    const double lead =
        (other.cost.mean - best.cost.mean) / std::sqrt(std::max(other.cost.variance + best.cost.variance, 1e-300));
    result.lead = std::min(result.lead, lead);
  }

  result.world_from_body = best.match.world_from_body;
  result.cells = evidence.cells;
  result.blocks = evidence.blocks;
  result.overlap = static_cast<double>(evidence.cells) / std::max(best.match.known_cells, 1);
  result.misfit = evidence.misfit;
  result.determined = evidence.determined;
  result.sigma_m = evidence.sigma_m;
  result.sigma_rad = evidence.sigma_rad;
  if (evidence.blocks < options.fewest_blocks) {
    result.verdict = MatchVerdict::no_overlap;
  } else if (outside(world_from_body.pose, result.world_from_body, window, options)) {
    result.verdict = MatchVerdict::at_edge;
  } else if (evidence.misfit > options.largest_misfit) {
    result.verdict = MatchVerdict::misfit;
  } else if (evidence.determined < 6) {
    result.verdict = MatchVerdict::flat;
  } else if (result.lead < options.lead_certainty) {
    result.verdict = MatchVerdict::ambiguous;
  } else {
    result.verdict = MatchVerdict::decided;
  }
  if (result.verdict == MatchVerdict::decided || result.verdict == MatchVerdict::flat)
    result.information = in_body(evidence.information, result.world_from_body);
  return result;
}

}  // namespace spartan
