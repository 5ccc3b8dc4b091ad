// Continuous refinement of a map match: Gauss-Newton on elevation differences.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/slam/internal/surface_grid.h"
#include "spartan/slam/slam_options.h"

namespace spartan::internal {

/// A cell that both maps have observed. The tangent η = (t, θ) moves the local map by p → p + t + θ × (p − c).
struct MatchedCell {
  int column = 0, row = 0;
  double residual_m = 0;      ///< Local minus global elevation.
  double sigma_m = 0;         ///< Standard deviation of the residual, from variances and relief of both cells.
  double weight = 0;          ///< ψ(r)/r of the robust cost, m⁻².
  double curvature = 0;       ///< ψ'(r), m⁻²; negative for outliers.
  double common_error_m = 0;  ///< Change of the residual by a common range error of one standard deviation.
  double relief_error_m =
      0;  ///< The same where only relief is displaced (fronto-parallel bias) and level ground is not.
  Vector6d jacobian_by_local = Vector6d::Zero();   ///< ∂residual/∂η with the slope of the local map.
  Vector6d jacobian_by_global = Vector6d::Zero();  ///< ∂residual/∂η with the slope of the global map.
  Vector6d jacobian() const { return 0.5 * (jacobian_by_local + jacobian_by_global); }
};

/// ∂(elevation at a fixed place)/∂η of a surface with this slope at p − c: (n, (p − c) × n) with n = (−slope, 1).
Vector6d elevation_jacobian(const Eigen::Vector2d& slope, const Eigen::Vector3d& from_centre);

/// Scale of the residuals: s² = (scale σ)² + inflation², robust cost ½ k² u²/(1 + u²) with u = r/(k s) (Geman-McClure),
/// so that ψ(r) = r / (s² (1 + u²)²).
struct ResidualScale {
  double inflation_m = 0;
  double scale = 1;
};
/// The origin of the body frame and the camera centre of a local map, world frame.
struct Viewpoint {
  Eigen::Vector3d body = Eigen::Vector3d::Zero(), camera = Eigen::Vector3d::Zero();
};
/// The common origin of the points' rays (camera centre), in the points' frame: the solution o of Σ (I − a aᵀ)(p − o) =
/// 0, a the ray directions.
Eigen::Vector3d ray_origin_of(std::span<const SurfacePoint> points);

/// The cells that both grids, which must have the same window, have observed. The centre c of their tangent is the
/// body.
std::vector<MatchedCell> matched_cells(const SurfaceGrid& local, const SurfaceGrid& global, const Viewpoint& from,
                                       const ResidualScale& scale, const MatchOptions& options);
/// Median |residual| / (0.6745 σ): 1 for normally distributed residuals whose variances are right.
double median_normalized_residual(std::span<const MatchedCell> cells);

/// Downsamples points on a square grid of the body's x-y plane: one mean point for each occupied square.
std::vector<SurfacePoint> downsampled(std::span<const SurfacePoint> points, double side_m);

struct RefinedMatch {
  Pose world_from_body;
  bool converged = false;
  int iterations = 0;
  double normalized_residual = 1;
  std::vector<MatchedCell> cells;  ///< At that pose, tangents about its body origin.
  int known_cells = 0;             ///< Observed cells of the local map at that pose, overlapping or not.
};

/// Gauss-Newton with robust weights. The points are rasterized into the cells of the global map again at every
/// iteration, so that the same ground is compared cell by cell and nothing is interpolated. The Jacobian uses the mean
/// of both maps' slopes (efficient second-order minimization, Benhimane & Malis, IROS 2004). None where fewer than
/// min_cells overlap.
std::optional<RefinedMatch> refine_match(std::span<const SurfacePoint> points, const SurfaceGrid& global,
                                         const Pose& world_from_body, int min_points, const MatchOptions& options);

/// Applies a world tangent η = (t, θ) about `centre` to a pose: p → c + Exp(θ)(p − c) + t.
Pose moved(const Pose& world_from_body, const Eigen::Vector3d& centre, const Vector6d& tangent);

}  // namespace spartan::internal
