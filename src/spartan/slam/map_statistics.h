// Statistics of a global map of any size.
#pragma once

#include <array>
#include <cstdint>

#include "spartan/slam/global_map.h"

namespace spartan {

/// Statistics of the observed cells; all 0 where there are none.
struct MapStatistics {
  std::array<std::int64_t, 4> cells{};             ///< Number of cells by GroundClass.
  std::int64_t known = 0;                          ///< Number of observed cells.
  float min_elevation_m = 0, max_elevation_m = 0;  ///< Lowest and highest elevation.
  float median_variance_m2 = 0;  ///< Of the elevations; the upper of the two middle values of an even number.
};

/// Processes windows of at most `side` by `side` cells one after the other, in two passes. Codes: GlobalMap::view's.
Result<MapStatistics> map_statistics(GlobalMap& map, int side = 512);

}  // namespace spartan
