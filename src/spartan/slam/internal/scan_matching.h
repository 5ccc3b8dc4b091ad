// Correlative scan matching of two elevation maps: exhaustive search over x, y and yaw (the paper's "jittering").
#pragma once

#include <Eigen/Core>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/core/threads.h"
#include "spartan/slam/internal/surface_grid.h"
#include "spartan/slam/slam_options.h"

namespace spartan::internal {

/// Half sizes of the search window around the prior pose.
struct SearchWindow {
  double x_m = 0, y_m = 0, yaw_rad = 0;
};
/// The window that follows from the covariance of the prior pose: window_sigmas standard deviations, at most
/// max_search, at least one step.
SearchWindow search_window(const UncertainPose& world_from_body, const MatchOptions& options);

/// A local minimum of the matching cost.
struct ScanMatchPeak {
  Pose correction;       ///< world_from_world, to be applied to the local map.
  double cost = 1;       ///< 0 (all cells agree) … 1 (none agrees).
  bool at_edge = false;  ///< On the border of the search window.
};

/// All local minima, lowest cost first. `centre`: centre of rotation, near the middle of the local map. For every
/// translation and yaw, height, roll and pitch follow from the plane fitted to the elevation differences d by
/// iteratively reweighted least squares, so that they are not searched. The cost is the mean over all cells that both
/// maps have observed of u² / (1 + u²) (Geman-McClure), u² = d² / (elevation_scale² + variances), plus the class weight
/// times (1 − o₁ o₂)/2 of the signed occupancies o (see SurfaceGrid), divided by 1 + the class weight.
std::vector<ScanMatchPeak> correlative_scan_match(const SurfaceGrid& local, const SurfaceGrid& global,
                                                  const Eigen::Vector3d& centre, const SearchWindow& window,
                                                  const MatchOptions& options, const ThreadPool& workers);

}  // namespace spartan::internal
