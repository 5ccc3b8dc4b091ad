#include "spartan/sim/clear_way.h"

#include <cmath>

namespace spartan::sim {
namespace {

std::uint64_t key_of(std::int32_t i, std::int32_t j) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) << 32U | static_cast<std::uint32_t>(j);
}

std::int32_t cell_of(double v, double cell_m) {
  return static_cast<std::int32_t>(std::floor(v / cell_m));
}

}  // namespace

ClearWay::ClearWay(const std::vector<PlanarPose>& track, double half_width_m) : half_width_m_(half_width_m) {
  for (const PlanarPose& p : track) cells_[key_of(cell_of(p.x, kCell_m), cell_of(p.y, kCell_m))].push_back(p);
}

bool ClearWay::blocked_by(double x, double y, double radius_m) const {
  const double reach = half_width_m_ + radius_m;
  for (std::int32_t j = cell_of(y - reach, kCell_m); j <= cell_of(y + reach, kCell_m); ++j) {
    for (std::int32_t i = cell_of(x - reach, kCell_m); i <= cell_of(x + reach, kCell_m); ++i) {
      const auto found = cells_.find(key_of(i, j));
      if (found == cells_.end()) continue;
      for (const PlanarPose& p : found->second) {
        if (std::hypot(p.x - x, p.y - y) < reach) return true;
      }
    }
  }
  return false;
}

}  // namespace spartan::sim
