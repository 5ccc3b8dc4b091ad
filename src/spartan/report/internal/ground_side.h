// The ground that pairs see, from the side.
#pragma once

#include <optional>
#include <vector>

#include "spartan/report/internal/ground_parts.h"

namespace spartan::internal {

/// `shared_m` of the middle column is seen by all pairs. Gives the row, px, below which nothing is drawn.
double draw_side(Drawing& drawing, double top_px, const std::vector<DrawnPair>& pairs, std::optional<double> shared_m);

}  // namespace spartan::internal
