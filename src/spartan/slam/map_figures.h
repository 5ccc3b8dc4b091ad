// What a global map of any size amounts to.
#pragma once

#include <array>
#include <cstdint>

#include "spartan/slam/global_map.h"

namespace spartan {

/// Of the cells that were seen; all 0 where none was.
struct MapFigures {
  std::array<std::int64_t, 4> cells{};  ///< by class (docs/formats.md, "Maps")
  std::int64_t known = 0;
  float least_m = 0, most_m = 0;  ///< elevation
  float median_variance_m2 = 0;   ///< of the elevation; the upper one of an even number
};

/// Looks at pieces of `side` by `side` cells one after the other, each of them twice. Codes: GlobalMap::view's.
Result<MapFigures> figures_of(GlobalMap& map, int side = 512);

}  // namespace spartan
