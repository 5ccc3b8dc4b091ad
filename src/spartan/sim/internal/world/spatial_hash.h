// A hash grid of items on the plane.
#pragma once

#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "spartan/sim/internal/world/region.h"

namespace spartan::sim::internal {

/// Items in square cells of kCell_m.
template <class Item>
class SpatialHash {
 public:
  void add(double x, double y, Item item) { cells_[key_of(cell_of(x), cell_of(y))].push_back(std::move(item)); }

  /// Calls `visit(item)` for all items in the region, and for some around it, until it returns true. Returns whether it
  /// did.
  template <class Visit>
  bool any_near(const Region& region, Visit&& visit) const {
    for (std::int32_t j = cell_of(region.y0); j <= cell_of(region.y1); ++j) {
      for (std::int32_t i = cell_of(region.x0); i <= cell_of(region.x1); ++i) {
        const auto found = cells_.find(key_of(i, j));
        if (found == cells_.end()) continue;
        for (const Item& item : found->second) {
          if (visit(item)) return true;
        }
      }
    }
    return false;
  }

 private:
  static constexpr double kCell_m = 0.5;
  static std::int32_t cell_of(double v) { return static_cast<std::int32_t>(std::floor(v / kCell_m)); }
  static std::uint64_t key_of(std::int32_t i, std::int32_t j) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) << 32U | static_cast<std::uint32_t>(j);
  }

  std::unordered_map<std::uint64_t, std::vector<Item>> cells_;
};

}  // namespace spartan::sim::internal
