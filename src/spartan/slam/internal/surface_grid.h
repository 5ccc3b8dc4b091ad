// Elevation grids on the world lattice, the input of map matching.
#pragma once

#include <Eigen/Core>
#include <span>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/reconstruction/map_generator.h"
#include "spartan/slam/global_map.h"

namespace spartan::internal {

/// All images have the size of the window. Unknown cells are NaN.
struct SurfaceGrid {
  LatticeWindow window;
  double cell_m = 0.05;
  Image<float> elevation_m;
  Image<float> variance_m2;  ///< Variance of the elevation by noise, without errors of the calibration.
  Image<float> relief_m;     ///< Highest minus lowest point in the cell.
  Image<float> occupancy;    ///< Signed occupancy 2p − 1 = tanh(log-odds / 2) of an obstacle or a cavity; 0: unknown.

  /// East and north slope by finite differences of the neighbours (central, or one-sided at a border); NaN without any.
  Eigen::Vector2f slope(int column, int row) const;
  /// Bilinear interpolation between cell centres; NaN where one of the four cells is unknown.
  float elevation_at(double x_m, double y_m) const;
};

/// Rasterizes points into cells: inverse-variance weighted means at the centres of the cells, as the map generator
/// computes them. A cell with fewer than `min_points` points is unknown. The occupancy is 0.
SurfaceGrid rasterize(std::span<const SurfacePoint> points, const Pose& world_from_body, const LatticeWindow& window,
                      double cell_m, int min_points);

/// The grid of a local map.
SurfaceGrid grid_of(const LocalMap& map);

/// Halves the resolution: inverse-variance weighted means of 2×2 cells, of which at least two must be known.
SurfaceGrid coarser(const SurfaceGrid& grid);

}  // namespace spartan::internal
