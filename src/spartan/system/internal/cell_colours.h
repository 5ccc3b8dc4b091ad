// Colours of the cells of a map by points that were seen in images.
#pragma once

#include <array>
#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/reconstruction/point_cloud.h"
#include "spartan/slam/global_map.h"

namespace spartan::internal {

/// Takes one point cloud after the other.
class CellColours {
 public:
  explicit CellColours(const MapView& view) : place_(view.place()), sums_(view.window.width, view.window.height) {}
  void add(const PointCloud& points);
  /// As SavedMap::cell_colours().
  Image<Rgb8> image(const MapView& view) const;

 private:
  GeoTransform place_;
  Image<std::array<std::uint32_t, 4>> sums_;  // red, green, blue, count
  bool any_ = false;
};

}  // namespace spartan::internal
