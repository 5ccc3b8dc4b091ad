#include "spartan/reconstruction/internal/cell_support.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "spartan/numerics/connected_components.h"

namespace spartan::internal {

Image<std::uint8_t> isolated_cells(const CellHeights& heights, double max_gap_m, int min_cells) {
  const auto [w, h] = heights.lowest_m.size();
  constexpr std::uint8_t kIsolated = 1, kNew = 2, kGrouped = 0;
  Image<std::uint8_t> state(w, h, kIsolated);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) state(x, y) = std::isfinite(heights.lowest_m(x, y)) ? kNew : kIsolated;
  }
  const auto gap = static_cast<float>(max_gap_m);
  const auto touch = [&](const PixelIndex& a, const PixelIndex& b) {
    return heights.lowest_m(a.x, a.y) - heights.highest_m(b.x, b.y) <= gap &&
           heights.lowest_m(b.x, b.y) - heights.highest_m(a.x, a.y) <= gap;
  };
  std::vector<PixelIndex> group;
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      if (state(x, y) != kNew) continue;
      group.assign(1, {x, y});
      state(x, y) = kGrouped;
      for (std::size_t next = 0; next < group.size(); ++next) {
        const PixelIndex at = group[next];
        for (int j = std::max(at.y - 1, 0); j <= std::min(at.y + 1, h - 1); ++j) {
          for (int i = std::max(at.x - 1, 0); i <= std::min(at.x + 1, w - 1); ++i) {
            if (state(i, j) != kNew || !touch(at, {i, j})) continue;
            state(i, j) = kGrouped;
            group.push_back({i, j});
          }
        }
      }
      if (static_cast<int>(group.size()) >= min_cells) continue;
      for (const PixelIndex& at : group) state(at.x, at.y) = kIsolated;
    }
  }
  return state;
}

Image<std::uint8_t> cells_seen_through_ground(const CellHeights& heights, const GroundView& view) {
  const auto [w, h] = heights.lowest_m.size();
  const auto step = static_cast<float>(view.cell_m), margin = static_cast<float>(view.margin_m);
  const int limit = static_cast<int>(view.opening_m / view.cell_m);
  const auto is_hidden = [&](int column, int row) {
    const LineOfSight& line = view.towards_camera(column, row);
    if (!(line.rise > 0)) return false;
    float height = heights.highest_m(column, row);
    int below = 0;
    // A vertical line does not leave the map.
    const int last = static_cast<int>(std::min(line.length_m / step, static_cast<float>(w + h)));
    for (int k = 0; k < last; ++k, height += line.rise * step) {
      const int x = column + static_cast<int>(std::lround(line.x * static_cast<float>(k))),
                y = row - static_cast<int>(std::lround(line.y * static_cast<float>(k)));
      if (!view.ground_m.contains(x, y)) return false;
      const float ground = view.ground_m(x, y);
      if (!std::isfinite(ground)) continue;
      if (height < ground - margin && ++below > limit) return true;
    }
    return false;
  };
  Image<std::uint8_t> hidden(w, h);
  for (int row = 0; row < h; ++row) {
    for (int column = 0; column < w; ++column)
      hidden(column, row) = std::isfinite(heights.highest_m(column, row)) && is_hidden(column, row) ? 1 : 0;
  }
  return hidden;
}

}  // namespace spartan::internal
