// Continuous refinement of a match: least squares on the elevations' differences.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/slam/slam_options.h"
#include "spartan/slam/surface_grid.h"

namespace spartan {

/// A cell that both maps know. The tangent η = (t, θ) moves the local map by p → p + t + θ × (p − c).
struct MatchedCell {
  int column = 0, row = 0;
  double residual_m = 0;  ///< local less global elevation
  double sigma_m = 0;     ///< of the residual, by the cells' variances and relief
  double weight = 0;      ///< ψ(r)/r of the robust cost, m⁻²
  double curvature = 0;   ///< ψ'(r), m⁻²; negative for outliers
  double common_m = 0;    ///< what the residual becomes where all disparities err in common by one standard deviation
  double relief_common_m = 0;             ///< the same where relief alone stands off, on level ground that does not
  Vector6d by_local = Vector6d::Zero();   ///< ∂residual/∂η with the local map's slope; no slope: (0, 0, 1 …)
  Vector6d by_global = Vector6d::Zero();  ///< the same with the global map's
  Vector6d jacobian() const { return 0.5 * (by_local + by_global); }
};

/// ∂(elevation at a fixed place)/∂η of a surface with this slope at p − c: (n, (p − c) × n) with n = (−slope, 1).
Vector6d elevation_jacobian(const Eigen::Vector2d& slope, const Eigen::Vector3d& from_centre);

/// How residuals count: s² = (scale σ)² + blur², robust cost ½ k² u²/(1 + u²) with u = r/(k s) (Geman-McClure), so
/// that ψ(r) = r / (s² (1 + u²)²).
struct ResidualScale {
  double blur_m = 0;
  double scale = 1;
};
/// Where a local map was seen from: origin of its points (the body) and the eye, in the world.
struct Viewpoint {
  Eigen::Vector3d body = Eigen::Vector3d::Zero(), eye = Eigen::Vector3d::Zero();
};
/// Where the rays of the points meet, in the points' frame: Σ (I − a aᵀ)(p − eye) = 0.
Eigen::Vector3d eye_of(std::span<const SurfacePoint> points);

/// The cells that both grids (of one window) know; c of their tangent is the viewpoint's body.
std::vector<MatchedCell> matched_cells(const SurfaceGrid& local, const SurfaceGrid& global, const Viewpoint& from,
                                       const ResidualScale& scale, const MatchOptions& options);
/// Median |residual| / (0.6745 σ): 1 for normal residuals as large as the variances say.
double misfit_of(std::span<const MatchedCell> cells);

/// One point for each small square of the body's plane, the mean of those in it.
std::vector<SurfacePoint> thinned(std::span<const SurfacePoint> points, double side_m);

struct RefinedMatch {
  Pose world_from_body;
  bool converged = false;
  int iterations = 0;
  double misfit = 1;
  std::vector<MatchedCell> cells;  ///< at that pose, about the body there
  int known_cells = 0;             ///< of the local map there, whether the global one knows them or not
};

/// Gauss-Newton; the points are thrown into the global map's cells anew at every step, so that the same ground is
/// compared cell by cell and nothing is interpolated. The Jacobian takes the mean of both maps' slopes (Benhimane and
/// Malis 2004: of second order). None where fewer than the fewest cells are left.
std::optional<RefinedMatch> refine_match(std::span<const SurfacePoint> points, const SurfaceGrid& global,
                                         const Pose& world_from_body, int fewest_points, const MatchOptions& options);

/// c-centred world tangent applied to a pose: p → c + Exp(θ)(p − c) + t.
Pose moved(const Pose& world_from_body, const Eigen::Vector3d& centre, const Vector6d& tangent);

}  // namespace spartan
