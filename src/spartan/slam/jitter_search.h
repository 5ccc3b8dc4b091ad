// The jittering search: a map is shifted and turned over another until they fit best.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/core/threads.h"
#include "spartan/slam/slam_options.h"
#include "spartan/slam/surface_grid.h"

namespace spartan {

/// What is searched, to each side of the given pose.
struct SearchWindow {
  double x_m = 0, y_m = 0, yaw_rad = 0;
};
/// From the covariance of a body's pose: so many sigmas, not more than the options' widest, at least a step.
SearchWindow search_window(const UncertainPose& world_from_body, const MatchOptions& options);

/// A place where the maps fit better than around it.
struct JitterPeak {
  Pose correction;       ///< world_from_world: apply it to the local map
  double cost = 1;       ///< 0 all cells agree … 1 none does
  bool at_edge = false;  ///< of the window
};

/// All peaks, best first. `centre`: of the turns, near the middle of the local map. For every shift and turn, height
/// and tilt are those of the plane through the elevations' differences d, found by least squares weighted anew, so that
/// they need no search. Cost of a cell: u² / (1 + u²) (Geman-McClure), u² = d² / (blur² + variances), plus the class
/// weight times (1 − e₁ e₂)/2 of the evidences; their mean over the cells that both maps know.
std::vector<JitterPeak> jitter_search(const SurfaceGrid& local, const SurfaceGrid& global,
                                      const Eigen::Vector3d& centre, const SearchWindow& window,
                                      const MatchOptions& options, const Workers& workers);

}  // namespace spartan
