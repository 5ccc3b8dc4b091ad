#include "spartan/reconstruction/internal/sgm_reference.h"

#include <algorithm>
#include <bit>
#include <vector>

namespace spartan::internal::sgm::reference {

void census_row(const CensusRow& row) {
  for (int x = 0; x < row.width; ++x) {
    for (int p = 0; p < kPlanes; ++p) {
      unsigned plane = 0;
      for (int b = 0; b < 8 && 8 * p + b < kCensusBits; ++b) {
        const Neighbour n = census_neighbour(8 * p + b);
        if (row.rows[n.row][x + n.column] < row.rows[3][x]) plane |= 1U << b;
      }
      row.planes[p][x] = static_cast<std::uint8_t>(plane);
    }
  }
}

void cost_row(const CostRow& row) {
  for (int x = 0; x < row.width; ++x) {
    for (int k = 0; k < row.padded; ++k) {
      int distance = 0;
      for (int p = 0; p < kPlanes; ++p) {
        distance += std::popcount(static_cast<std::uint8_t>(row.left[p][x] ^ row.right[p][k - x]));
      }
      row.cost[static_cast<std::ptrdiff_t>(x) * row.padded + k] = static_cast<std::uint8_t>(distance);
    }
  }
}

PathMinima pixel_paths(const PixelPaths& p) {
  PathMinima minima{{kNever, kNever, kNever, kNever}};
  std::vector<int> sums(static_cast<std::size_t>(p.padded), 0);
  std::vector<std::uint8_t> values(static_cast<std::size_t>(p.padded));
  const auto capped = [](int value) { return std::min(value, 255); };
  for (int r = 0; r < kPaths; ++r) {
    for (int k = 0; k < p.padded; ++k) {
      const int step = capped(std::min(p.from[r][k - 1], p.from[r][k + 1]) + p.p1);
      const int above = std::max(0, std::min<int>(p.from[r][k], step) - p.from_min[r]);
      const int value = capped(p.cost[k] + std::min<int>(above, p.p2[r]));
      values[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(value);
      sums[static_cast<std::size_t>(k)] += value;
      minima.of[r] = std::min(minima.of[r], static_cast<std::uint8_t>(value));
    }
    std::copy(values.begin(), values.end(), p.to[r]);
  }
  for (int k = 0; k < p.padded; ++k) {
    p.sum[k] = static_cast<std::uint16_t>(sums[static_cast<std::size_t>(k)] + (p.add != nullptr ? p.add[k] : 0));
  }
  return minima;
}

int find_winner(const std::uint16_t* sums, int padded) {
  return static_cast<int>(std::min_element(sums, sums + padded) - sums);
}

}  // namespace spartan::internal::sgm::reference
