#include "spartan/slam/map_cell.h"

#include <algorithm>
#include <limits>

namespace spartan {
namespace {

constexpr float kMostLogodds = 10;

bool agree(const CellSurface& a, const CellSurface& b, const CellFusion& fusion) {
  const double d = static_cast<double>(a.elevation_m) - b.elevation_m;
  const double relief_a = fusion.relief_sigma * (a.highest_m - a.lowest_m),
               relief_b = fusion.relief_sigma * (b.highest_m - b.lowest_m);
  const double variance =
      static_cast<double>(a.variance_m2) + b.variance_m2 + relief_a * relief_a + relief_b * relief_b;
  return d * d <= fusion.gate_sigmas * fusion.gate_sigmas * variance;
}

CellSurface fused(const CellSurface& a, const CellSurface& b, double least_variance) {
  const double va = a.variance_m2, vb = b.variance_m2, sum = va + vb;
  CellSurface f = a;
  f.elevation_m = static_cast<float>((vb * a.elevation_m + va * b.elevation_m) / sum);
  f.variance_m2 = std::min(a.variance_m2, static_cast<float>(std::max(va * vb / sum, least_variance)));
  f.lowest_m = std::min(a.lowest_m, b.lowest_m);
  f.highest_m = std::max(a.highest_m, b.highest_m);
  f.count = a.count + b.count;
  f.occupancy_logodds = std::clamp(a.occupancy_logodds + b.occupancy_logodds, -kMostLogodds, kMostLogodds);
  f.shape = static_cast<std::int16_t>(std::clamp(a.shape + b.shape, -30000, 30000));
  f.votes = static_cast<std::uint16_t>(std::min(a.votes + b.votes, 60000));
  return f;
}

// One vote less; nothing is left of the last.
CellSurface doubted(CellSurface rival) {
  if (rival.votes <= 1) return {};
  --rival.votes;
  return rival;
}

}  // namespace

int MapCell::kind() const {
  if (!surface.seen() || surface.votes == 0) return 0;
  if (surface.occupancy_logodds <= 0) return 1;
  return surface.shape >= 0 ? 2 : 3;
}

MapCell observed(const MapCell& cell, const CellSurface& observation, const CellFusion& fusion) {
  if (!observation.seen()) return cell;
  CellSurface seen = observation;
  seen.variance_m2 = std::max(seen.variance_m2, static_cast<float>(fusion.least_variance_m2));
  MapCell next = cell;
  if (!cell.surface.seen()) {
    next.surface = seen;
  } else if (agree(cell.surface, seen, fusion)) {
    next.surface = fused(cell.surface, seen, fusion.least_variance_m2);
    next.rival = doubted(cell.rival);
  } else if (!cell.rival.seen()) {
    next.rival = seen;
  } else if (agree(cell.rival, seen, fusion)) {
    next.rival = fused(cell.rival, seen, fusion.least_variance_m2);
    if (next.rival.variance_m2 <= next.surface.variance_m2) std::swap(next.surface, next.rival);
  } else {
    next.rival = doubted(cell.rival);
  }
  return next;
}

}  // namespace spartan
