// Cells of a map that wrong matches have made.
#pragma once

#include <cstdint>
#include <limits>

#include "spartan/core/image.h"

namespace spartan::internal {

/// Heights of the points of each cell, NaN where unknown; row 0 lies in the north. Borrowed.
struct CellHeights {
  ImageView<const float> lowest_m, highest_m;
};

/// Not 0: an unknown cell, or one of a group of fewer than `min_cells`. Neighbours (of eight) belong to one group where
/// their ranges of heights come within `max_gap_m` of each other. Wrong matches leave points metres above or below the
/// ground, where real objects have more cells or reach down to it.
Image<std::uint8_t> isolated_cells(const CellHeights& heights, double max_gap_m, int min_cells);

/// The direction from a cell towards the camera that sees it, per metre along the map: x, y and height.
struct LineOfSight {
  float x = 0, y = 0, rise = 0;
  float length_m = std::numeric_limits<float>::infinity();  ///< of the line along the map
};

/// Lines of sight below the ground.
struct GroundView {
  ImageView<const float> ground_m;  ///< NaN where unknown
  ImageView<const LineOfSight> towards_camera;
  double cell_m = 0.05;
  double margin_m = 0.15;  ///< by which a line has to be below the ground
  double opening_m = 0.6;  ///< length below the ground that an opening in it may let through
};

/// Not 0: a cell whose line of sight is below the ground over more than an opening: the camera would see it through the
/// ground.
Image<std::uint8_t> cells_seen_through_ground(const CellHeights& heights, const GroundView& view);

}  // namespace spartan::internal
