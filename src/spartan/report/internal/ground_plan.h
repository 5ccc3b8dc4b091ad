// The ground that pairs see, from above, with the pans and the azimuth that they see together.
#pragma once

#include <optional>
#include <vector>

#include "spartan/report/internal/ground_parts.h"

namespace spartan::internal {

/// The first pair is drawn with its pans, `pans` its figures; of the others the common view straight ahead. Gives the
/// row, px, below which nothing is drawn.
double draw_plan(Drawing& drawing, double top_px, const std::vector<DrawnPair>& pairs,
                 const std::optional<PanCoverage>& pans);

}  // namespace spartan::internal
