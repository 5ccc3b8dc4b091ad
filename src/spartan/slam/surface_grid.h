// Elevations on the lattice, as the matching of maps needs them.
#pragma once

#include <Eigen/Core>
#include <span>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/reconstruction/map_generator.h"
#include "spartan/slam/lattice.h"

namespace spartan {

/// NaN where nothing is known. All images have the window's size.
struct SurfaceGrid {
  LatticeWindow window;
  double cell_m = 0.05;
  Image<float> elevation_m;
  Image<float> variance_m2;  ///< of the elevation
  Image<float> relief_m;     ///< highest less lowest point in the cell
  Image<float> evidence;     ///< that something stands or gapes here: tanh(log-odds / 2), −1 … 1; 0 unknown

  /// East and north slope by the difference of the neighbours (central, or one-sided at an edge); NaN where it has
  /// none.
  Eigen::Vector2f slope(int column, int row) const;
  /// Bilinear between the cells' middles; NaN where one of the four is not known.
  float elevation_at(double x_m, double y_m) const;
};

/// Throws points into cells: means weighted by variance, as the map generator makes them. A cell with fewer than
/// `fewest_points` stays unknown. No evidence.
SurfaceGrid throw_on_grid(std::span<const SurfacePoint> points, const Pose& world_from_body,
                          const LatticeWindow& window, double cell_m, int fewest_points);

/// As it stands in a local map.
SurfaceGrid grid_of(const LocalMap& map);

/// Cells of twice the side: means weighted by variance.
SurfaceGrid coarser(const SurfaceGrid& grid);

}  // namespace spartan
