// Views of the global map before anything is drawn into them.
#pragma once

#include <cstdint>

#include "spartan/core/result.h"
#include "spartan/slam/global_map.h"

namespace spartan::internal {

/// A view without observed cells. Code `usage` for more than `most_cells` cells.
Result<MapView> blank_map_view(const LatticeWindow& window, double cell_m, std::int64_t most_cells);

}  // namespace spartan::internal
