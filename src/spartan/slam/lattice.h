// The world lattice of map cells: corners at integer multiples of the cell size, so that the cells of all maps
// coincide.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "spartan/core/geotiff.h"
#include "spartan/core/image.h"

namespace spartan {

/// A rectangle of cells. Column c holds x in [(west + c) s, (west + c + 1) s), row r holds y in
/// [(north − r − 1) s, (north − r) s), s the cell size: row 0 lies in the north, as in map files.
struct LatticeWindow {
  int west = 0, north = 0;
  int width = 0, height = 0;

  ImageSize size() const { return {width, height}; }
  std::int64_t cells() const { return std::int64_t{width} * height; }
  GeoTransform place(double cell_m) const { return {west * cell_m, north * cell_m, cell_m}; }
  friend bool operator==(const LatticeWindow&, const LatticeWindow&) = default;
};

/// All cells that intersect a rectangle of the world.
inline LatticeWindow window_between(double west_m, double south_m, double east_m, double north_m, double cell_m) {
  const int west = static_cast<int>(std::floor(west_m / cell_m)), east = static_cast<int>(std::ceil(east_m / cell_m)),
            south = static_cast<int>(std::floor(south_m / cell_m)),
            north = static_cast<int>(std::ceil(north_m / cell_m));
  return {west, north, east - west, north - south};
}

/// All cells within `reach_m` of a point, measured along x and y.
inline LatticeWindow window_around(double x_m, double y_m, double reach_m, double cell_m) {
  return window_between(x_m - reach_m, y_m - reach_m, x_m + reach_m, y_m + reach_m, cell_m);
}

/// The smallest window that contains both.
inline LatticeWindow window_around(const LatticeWindow& a, const LatticeWindow& b) {
  const int west = std::min(a.west, b.west), north = std::max(a.north, b.north),
            east = std::max(a.west + a.width, b.west + b.width),
            south = std::min(a.north - a.height, b.north - b.height);
  return {west, north, east - west, north - south};
}

/// The window of a map whose cells lie on the lattice.
inline LatticeWindow window_of(const GeoTransform& place, ImageSize size) {
  return {static_cast<int>(std::lround(place.west_m / place.cell_m)),
          static_cast<int>(std::lround(place.north_m / place.cell_m)), size.width, size.height};
}

}  // namespace spartan
