#include "spartan/slam/internal/surface_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace spartan::internal {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr double kMinSigma_m = 0.001;  // as the map generator's

SurfaceGrid empty_grid(const LatticeWindow& window, double cell_m) {
  SurfaceGrid grid;
  grid.window = window;
  grid.cell_m = cell_m;
  for (Image<float>* layer : {&grid.elevation_m, &grid.variance_m2, &grid.relief_m})
    *layer = Image<float>(window.width, window.height, kNaN);
  grid.occupancy = Image<float>(window.width, window.height, 0.0F);
  return grid;
}

// Finite difference between two neighbours of a cell, of which one may be unknown.
float difference(float before, float here, float after, float step) {
  const bool has_before = std::isfinite(before), has_after = std::isfinite(after);
  if (has_before && has_after) return (after - before) / (2 * step);
  if (has_after) return (after - here) / step;
  if (has_before) return (here - before) / step;
  return kNaN;
}

}  // namespace

Eigen::Vector2f SurfaceGrid::slope(int column, int row) const {
  const auto z = [&](int c, int r) { return elevation_m.contains(c, r) ? elevation_m(c, r) : kNaN; };
  const float here = z(column, row), step = static_cast<float>(cell_m);
  return {difference(z(column - 1, row), here, z(column + 1, row), step),
          difference(z(column, row + 1), here, z(column, row - 1), step)};
}

float SurfaceGrid::elevation_at(double x_m, double y_m) const {
  const double u = x_m / cell_m - window.west - 0.5, v = window.north - y_m / cell_m - 0.5;
  const double column = std::floor(u), row = std::floor(v);
  if (!(column >= 0 && row >= 0 && column + 1 < window.width && row + 1 < window.height)) return kNaN;
  const int c = static_cast<int>(column), r = static_cast<int>(row);
  const float a = static_cast<float>(u - column), b = static_cast<float>(v - row);
  const float *above = elevation_m.row(r) + c, *below = elevation_m.row(r + 1) + c;
  return (1 - b) * ((1 - a) * above[0] + a * above[1]) + b * ((1 - a) * below[0] + a * below[1]);
}

SurfaceGrid rasterize(std::span<const SurfacePoint> points, const Pose& world_from_body, const LatticeWindow& window,
                      double cell_m, int min_points) {
  struct Cell {
    double weights = 0, sum = 0;
    Eigen::Vector2d offsets =
        Eigen::Vector2d::Zero();  // weighted sum of the positions relative to the centre, in cells
    float lowest = std::numeric_limits<float>::infinity(), highest = -std::numeric_limits<float>::infinity();
    int count = 0;
  };
  // Coordinates are relative to the window's corner, where single precision is sufficient.
  const Eigen::Vector3d corner(window.west * cell_m, window.north * cell_m, 0);
  const Eigen::Matrix3f rotation = world_from_body.rotation_matrix().cast<float>();
  const Eigen::Vector3f translation = (world_from_body.translation() - corner).cast<float>();
  const float per_m = static_cast<float>(1 / cell_m);
  std::vector<Cell> cells(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height));
  for (const SurfacePoint& point : points) {
    const Eigen::Vector3f p = rotation * point.in_body + translation;
    const int column = static_cast<int>(std::floor(p.x() * per_m)), row = static_cast<int>(std::floor(-p.y() * per_m));
    if (column < 0 || row < 0 || column >= window.width || row >= window.height) continue;
    const double sigma =
        std::max(static_cast<double>(std::abs(rotation.row(2).dot(point.ray)) * point.sigma_m), kMinSigma_m);
    Cell& cell = cells[static_cast<std::size_t>(row) * static_cast<std::size_t>(window.width) +
                       static_cast<std::size_t>(column)];
    const double weight = 1 / (sigma * sigma);
    cell.weights += weight;
    cell.sum += weight * p.z();
    cell.offsets += weight * Eigen::Vector2d(static_cast<double>(p.x() * per_m) - column - 0.5,
                                             static_cast<double>(p.y() * per_m) + row + 0.5);
    cell.lowest = std::min(cell.lowest, p.z());
    cell.highest = std::max(cell.highest, p.z());
    ++cell.count;
  }
  SurfaceGrid grid = empty_grid(window, cell_m);
  Image<CellOffset> offsets(window.width, window.height);
  std::size_t i = 0;
  for (int row = 0; row < window.height; ++row) {
    for (int column = 0; column < window.width; ++column, ++i) {
      const Cell& cell = cells[i];
      if (cell.count < min_points) continue;
      grid.elevation_m(column, row) = static_cast<float>(cell.sum / cell.weights);
      offsets(column, row) = {static_cast<float>(cell.offsets.x() / cell.weights),
                              static_cast<float>(cell.offsets.y() / cell.weights)};
      grid.variance_m2(column, row) = static_cast<float>(cell.count / cell.weights);
      grid.relief_m(column, row) = cell.highest - cell.lowest;
    }
  }
  grid.elevation_m = at_cell_centres(grid.elevation_m, offsets);
  return grid;
}

SurfaceGrid grid_of(const LocalMap& map) {
  SurfaceGrid grid = empty_grid(window_of(map.place, map.size()), map.place.cell_m);
  for (int r = 0; r < grid.window.height; ++r) {
    for (int c = 0; c < grid.window.width; ++c) {
      if (!(map.count(c, r) > 0)) continue;
      grid.elevation_m(c, r) = map.elevation_m(c, r);
      grid.variance_m2(c, r) = map.variance_m2(c, r);
      if (!map.common_variance_m2.empty()) grid.variance_m2(c, r) -= map.common_variance_m2(c, r);
      grid.relief_m(c, r) = map.elevation_max_m(c, r) - map.elevation_min_m(c, r);
      grid.occupancy(c, r) = std::tanh(0.5F * map.occupancy_logodds(c, r));
    }
  }
  return grid;
}

SurfaceGrid coarser(const SurfaceGrid& grid) {
  // Corners of the coarse lattice are every second corner of the fine one.
  const auto half_down = [](int i) { return i >= 0 ? i / 2 : -((1 - i) / 2); };
  const LatticeWindow& fine = grid.window;
  LatticeWindow window;
  window.west = half_down(fine.west);
  window.north = half_down(fine.north + 1);
  window.width = half_down(fine.west + fine.width + 1) - window.west;
  window.height = window.north - half_down(fine.north - fine.height);
  SurfaceGrid coarse = empty_grid(window, 2 * grid.cell_m);
  for (int r = 0; r < window.height; ++r) {
    for (int c = 0; c < window.width; ++c) {
      const int c0 = 2 * (window.west + c) - fine.west, r0 = fine.north - 2 * (window.north - r);
      double weights = 0, sum = 0;
      float lowest = std::numeric_limits<float>::infinity(), highest = -lowest, relief = 0, occupancy = 0;
      int known = 0;
      for (int j = r0; j < r0 + 2; ++j) {
        for (int i = c0; i < c0 + 2; ++i) {
          if (!grid.elevation_m.contains(i, j) || !std::isfinite(grid.elevation_m(i, j))) continue;
          const float z = grid.elevation_m(i, j);
          const double weight = 1 / static_cast<double>(grid.variance_m2(i, j));
          weights += weight;
          sum += weight * z;
          lowest = std::min(lowest, z);
          highest = std::max(highest, z);
          relief = std::max(relief, grid.relief_m(i, j));
          occupancy += grid.occupancy(i, j);
          ++known;
        }
      }
      if (known < 2) continue;
      coarse.elevation_m(c, r) = static_cast<float>(sum / weights);
      coarse.variance_m2(c, r) = static_cast<float>(known / weights);
      coarse.relief_m(c, r) = std::max(relief, highest - lowest);
      coarse.occupancy(c, r) = occupancy / static_cast<float>(known);
    }
  }
  return coarse;
}

}  // namespace spartan::internal
