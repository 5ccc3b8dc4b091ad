#include "spartan/reconstruction/internal/matching/full_range_reference.h"

#include <algorithm>
#include <bit>
#include <vector>

namespace spartan::internal::matching::reference {
namespace {

// One pixel of a path: path costs before the subtraction of their minimum. from[−1] and from[levels] are read.
struct Step {
  const std::uint8_t* from;
  int from_min, p1, p2;
};
int path_cost(const Step& s, int cost, int k) {
  const int steps = std::min(std::min(s.from[k - 1], s.from[k + 1]) + s.p1, 255);
  const int above = std::max(0, std::min<int>(s.from[k], steps) - s.from_min);
  return std::min(cost + std::min(above, s.p2), 255);
}

}  // namespace

void cost_row(const FullCostRow& row) {
  for (int x = 0; x < row.width; ++x) {
    for (int k = 0; k < row.levels; ++k) {
      int distance = 0;
      for (int p = 0; p < kPlanes; ++p)
        distance += std::popcount(static_cast<std::uint8_t>(row.left[p][x] ^ row.right[p][k - x]));
      row.cost[static_cast<std::ptrdiff_t>(x) * row.levels + k] = static_cast<std::uint8_t>(distance);
    }
  }
}

void vertical_row(const FullVerticalRow& row) {
  for (int x = 0; x < row.width; ++x) {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(x) * row.levels;
    if (!row.add) std::fill_n(row.sum + at, row.levels, std::uint16_t{0});
    for (int path = 0; path < 3; ++path) {
      const Step step{row.from[path] + at, row.from_min[path][x], row.p1, row.p2[path][x]};
      std::uint8_t least = kNever;
      for (int k = 0; k < row.levels; ++k) {
        const auto value = static_cast<std::uint8_t>(path_cost(step, row.cost[at + k], k));
        row.to[path][at + k] = value;
        row.sum[at + k] = static_cast<std::uint16_t>(row.sum[at + k] + value);
        least = std::min(least, value);
      }
      row.to_min[path][x] = least;
    }
  }
}

void horizontal_rows(const FullHorizontalRows& rows) {
  const auto guarded = static_cast<std::size_t>(rows.levels) + 2;
  for (int r = 0; r < kRowsAtOnce; ++r) {
    for (const bool from_left : {true, false}) {
      std::vector<std::uint8_t> before(guarded, 0), now(guarded, kNever);
      before.front() = before.back() = kNever;
      std::uint8_t least = 0;
      const std::uint8_t* const p2 = from_left ? rows.p2_from_left[r] : rows.p2_from_right[r];
      for (int i = 0; i < rows.width; ++i) {
        const int x = from_left ? i : rows.width - 1 - i;
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(x) * rows.levels;
        const Step step{before.data() + 1, least, rows.p1, p2[x]};
        least = kNever;
        for (int k = 0; k < rows.levels; ++k) {
          const auto value = static_cast<std::uint8_t>(path_cost(step, rows.cost[r][at + k], k));
          now[static_cast<std::size_t>(k) + 1] = value;
          rows.sum[r][at + k] = static_cast<std::uint16_t>(rows.sum[r][at + k] + value);
          least = std::min(least, value);
        }
        std::swap(before, now);
      }
    }
  }
}

int find_winner(const std::uint16_t* sums, int levels) {
  return static_cast<int>(std::min_element(sums, sums + levels) - sums);
}

}  // namespace spartan::internal::matching::reference
