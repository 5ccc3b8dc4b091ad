#include "spartan/reconstruction/internal/matching/interval_reference.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>

namespace spartan::internal::matching::reference {
namespace {

using PathCosts = std::array<std::uint8_t, kLevels>;

// One pixel of a path: replaces L' − min L' by L − min L and returns L.
PathCosts advance(const std::uint8_t* cost, int p1, int p2, std::uint8_t* path) {
  PathCosts now{};
  for (int level = 0; level < kLevels; ++level) {
    const int k = level % kInterval;
    const int lower = k > 0 ? path[level - 1] : kNever, upper = k + 1 < kInterval ? path[level + 1] : kNever;
    const int stepped = std::min(std::min(lower, upper) + p1, 255);
    const int before = std::min({static_cast<int>(path[level]), stepped, p2});
    now[static_cast<std::size_t>(level)] = static_cast<std::uint8_t>(std::min(cost[level] + before, 255));
  }
  const std::uint8_t least = *std::min_element(now.begin(), now.end());
  for (int level = 0; level < kLevels; ++level)
    path[level] = static_cast<std::uint8_t>(now[static_cast<std::size_t>(level)] - least);
  return now;
}

void add_to(const PathCosts& costs, std::uint16_t* sum) {
  for (int level = 0; level < kLevels; ++level) {
    std::uint16_t& to = sum[sum_index(level)];
    to = static_cast<std::uint16_t>(to + costs[static_cast<std::size_t>(level)]);
  }
}

int cost_at(const std::uint8_t* old, int level) {
  return level < 0 || level >= kInterval ? kNever : old[level];
}

}  // namespace

void census_row(const CensusRow& row) {
  for (int x = 0; x < row.width; ++x) {
    for (int p = 0; p < kPlanes; ++p) {
      unsigned plane = 0;
      for (int b = 0; b < 8; ++b) {
        const Neighbour n = kCensusNeighbours[static_cast<std::size_t>(8 * p + b)];
        if (row.rows[n.row][x + n.column] < row.rows[3][x]) plane |= 1U << b;
      }
      row.planes[p][x] = static_cast<std::uint8_t>(plane);
    }
  }
}

void cost_row(const CostRow& row) {
  for (int x = 0; x < row.width; ++x) {
    for (int level = 0; level < kLevels; ++level) {
      const int d = level < kInterval ? row.first[x] + level : row.second[x] + level - kInterval;
      int distance = 0;
      for (int p = 0; p < kPlanes; ++p)
        distance += std::popcount(static_cast<std::uint8_t>(row.left[p][x] ^ row.right[p][d - x]));
      row.cost[static_cast<std::ptrdiff_t>(x) * kLevels + level] =
          d > x ? row.out_of_view : static_cast<std::uint8_t>(distance);
    }
  }
}

void p2_row(const P2Row& row) {
  for (int x = 0; x < row.width; ++x) row.p2[x] = row.table[std::min(std::abs(row.here[x] - row.before[x]) / 4, 15)];
}

void vertical_row(const VerticalRow& row) {
  for (int x = 0; x < row.width; ++x) {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(x) * kLevels;
    if (!row.add) std::fill(row.sum + at, row.sum + at + kLevels, std::uint16_t{0});
    for (int path = 0; path < 3; ++path) {
      PathCosts levels;
      std::copy(row.from[path] + at, row.from[path] + at + kLevels, levels.begin());
      add_to(advance(row.cost + at, row.p1, row.p2[path][x], levels.data()), row.sum + at);
      std::copy(levels.begin(), levels.end(), row.to[path] + at);
    }
  }
}

void apply(const TransitionRun& run) {
  const Transition& t = run.transition;
  if (t.none()) return;
  for (int i = 0; i < run.count; ++i) {
    std::uint8_t* const costs = run.costs + static_cast<std::ptrdiff_t>(i) * kLevels;
    PathCosts old;
    std::copy(costs, costs + kLevels, old.begin());
    const std::uint8_t *const first = old.data(), *const second = first + kInterval;
    for (int k = 0; k < kInterval; ++k) {
      costs[k] =
          static_cast<std::uint8_t>(std::min(cost_at(first, k + t.first_first), cost_at(second, k + t.first_second)));
      costs[kInterval + k] =
          static_cast<std::uint8_t>(std::min(cost_at(first, k + t.second_first), cost_at(second, k + t.second_second)));
    }
  }
}

void horizontal_rows(const HorizontalRows& rows) {
  for (int r = 0; r < kRowsAtOnce; ++r) {
    const auto pixel = [&](int x, int p2, PathCosts& path) {
      const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(x) * kLevels;
      add_to(advance(rows.cost[r] + at, rows.p1, p2, path.data()), rows.sum[r] + at);
    };
    PathCosts path{};
    for (int i = 0; i < rows.run_count; ++i) {
      if (i > 0) apply({path.data(), 1, rows.runs[i].from_left});
      for (int x = rows.runs[i].from; x < rows.runs[i].to; ++x) pixel(x, rows.p2_from_left[r][x], path);
    }
    path.fill(0);
    for (int i = rows.run_count - 1; i >= 0; --i) {
      if (i + 1 < rows.run_count) apply({path.data(), 1, rows.runs[i].from_right});
      for (int x = rows.runs[i].to - 1; x >= rows.runs[i].from; --x) pixel(x, rows.p2_from_right[r][x], path);
    }
  }
}

void select_row(const SelectRow& row) {
  for (int x = 0; x < row.width; ++x) {
    const std::uint16_t* const sum = row.sum + static_cast<std::ptrdiff_t>(x) * kLevels;
    unsigned best = 0xFFFF;
    for (int level = 0; level < kLevels; ++level) {
      const unsigned shifted = static_cast<unsigned>(sum[sum_index(level)]) << 5;
      best = std::min(best, shifted | static_cast<unsigned>(level));
      const int d = level < kInterval ? row.first[x] + level : row.second[x] + level - kInterval;
      if (row.right_best == nullptr) continue;
      std::uint16_t& right = row.right_best[d - x];
      right = std::min(right, static_cast<std::uint16_t>(shifted | static_cast<unsigned>(x & 31)));
    }
    row.winner[x] = static_cast<std::uint16_t>(best);
  }
}

}  // namespace spartan::internal::matching::reference
