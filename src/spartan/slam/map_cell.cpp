#include <algorithm>
#include <cmath>
#include <limits>

#include "spartan/slam/tile_store.h"

namespace spartan {
namespace {

constexpr float kLeastWeight = 0.1F;  // of the newest observation in the mean of the lowest and highest points
constexpr float kMaxLogodds = 10;     // saturation, so that a cell can still change after many observations

bool agree(const CellSurface& a, const CellSurface& b, const CellFusion& fusion) {
  const double d = static_cast<double>(a.elevation_m) - b.elevation_m;
  const double relief_a = fusion.relief_sigma_ratio * (a.highest_m - a.lowest_m),
               relief_b = fusion.relief_sigma_ratio * (b.highest_m - b.lowest_m);
  const double variance =
      static_cast<double>(a.variance_m2) + b.variance_m2 + relief_a * relief_a + relief_b * relief_b;
  return d * d <= fusion.gate_sigmas * fusion.gate_sigmas * variance;
}

CellSurface fused(const CellSurface& a, const CellSurface& b, double least_variance) {
  const double va = a.variance_m2, vb = b.variance_m2, ca = a.common_variance_m2, cb = b.common_variance_m2,
               k = std::sqrt(ca * cb), sum = va + vb - 2 * k;
  const double wa = sum > 0 ? std::clamp((vb - k) / sum, 0.0, 1.0) : 1, wb = 1 - wa;
  const double variance = wa * wa * va + wb * wb * vb + 2 * wa * wb * k,
               common = wa * wa * ca + wb * wb * cb + 2 * wa * wb * k;
  CellSurface f = a;
  f.elevation_m = static_cast<float>(wa * a.elevation_m + wb * b.elevation_m);
  f.variance_m2 = std::min(a.variance_m2, static_cast<float>(std::max(variance - common, least_variance) + common));
  f.common_variance_m2 =
      std::clamp(f.variance_m2 - static_cast<float>(least_variance), 0.0F, static_cast<float>(common));
  // Running means, not extrema: these would only grow with every wrong point.
  const float weight =
      std::max(kLeastWeight, static_cast<float>(b.votes) / static_cast<float>(std::max(a.votes + b.votes, 1)));
  f.lowest_m = std::min(a.lowest_m + weight * (b.lowest_m - a.lowest_m), f.elevation_m);
  f.highest_m = std::max(a.highest_m + weight * (b.highest_m - a.highest_m), f.elevation_m);
  f.count = a.count + b.count;
  f.occupancy_logodds = std::clamp(a.occupancy_logodds + b.occupancy_logodds, -kMaxLogodds, kMaxLogodds);
  f.shape = static_cast<std::int16_t>(std::clamp(a.shape + b.shape, -30000, 30000));
  f.votes = static_cast<std::uint16_t>(std::min(a.votes + b.votes, 60000));
  return f;
}

// The part of the variance that counting shrinks. Of two surfaces that contradict each other it says which is known
// better: errors of the calibration do not make a surface that was confirmed many times less certain than a wrong
// match.
float independent_variance(const CellSurface& surface) {
  return surface.variance_m2 - surface.common_variance_m2;
}

// Removes one vote; the last one removes the surface.
CellSurface with_one_vote_less(CellSurface alternative) {
  if (alternative.votes <= 1) return {};
  --alternative.votes;
  return alternative;
}

}  // namespace

GroundClass MapCell::kind() const {
  if (!surface.observed() || surface.votes == 0) return GroundClass::unknown;
  if (surface.occupancy_logodds <= 0) return GroundClass::ground;
  return surface.shape >= 0 ? GroundClass::obstacle : GroundClass::cavity;
}

MapCell fuse_observation(const MapCell& cell, const CellSurface& observation, const CellFusion& fusion) {
  if (!observation.observed()) return cell;
  CellSurface seen = observation;
  seen.variance_m2 = std::max(seen.variance_m2, seen.common_variance_m2 + static_cast<float>(fusion.least_variance_m2));
  MapCell next = cell;
  if (!cell.surface.observed()) {
    next.surface = seen;
  } else if (agree(cell.surface, seen, fusion)) {
    next.surface = fused(cell.surface, seen, fusion.least_variance_m2);
    next.alternative = with_one_vote_less(cell.alternative);
  } else if (!cell.alternative.observed()) {
    next.alternative = seen;
    if (independent_variance(seen) < independent_variance(cell.surface)) std::swap(next.surface, next.alternative);
  } else if (agree(cell.alternative, seen, fusion)) {
    next.alternative = fused(cell.alternative, seen, fusion.least_variance_m2);
    if (independent_variance(next.alternative) <= independent_variance(next.surface))
      std::swap(next.surface, next.alternative);
  } else {
    next.alternative = with_one_vote_less(cell.alternative);
  }
  return next;
}

}  // namespace spartan
