// The inner loops of census matching and semi-global aggregation, one version per instruction set.
//
// A census signature has 62 bits in 8 byte planes: bit b of plane p is set where neighbour 8p + b of the 9×7 window is
// darker than the centre (Zabih & Woodfill, ECCV 1994). Cost of (x, d) = Hamming distance of the left signature at x
// and the right one at x − d. Right planes are stored mirrored, so that growing d runs forward in memory.
#pragma once

#include <cstddef>
#include <cstdint>

namespace spartan::sgm {

inline constexpr int kPlanes = 8;
inline constexpr int kCensusBits = 62;
inline constexpr int kPaths = 4;             ///< of one pass; the other pass has the opposite four
inline constexpr int kGuard = 64;            ///< bytes before and after each path slot, always 255
inline constexpr std::uint8_t kNever = 255;  ///< cost of the disparities that fill up a vector

/// Where a bit of the signature looks: row 0 … 6 (3 is the centre's), column −4 … 4.
struct Neighbour {
  int row, column;
};
constexpr Neighbour census_neighbour(int bit) {
  const int at = bit < 31 ? bit : bit + 1;
  return {at / 9, at % 9 - 4};
}

/// One row of the gray image → one row of each plane. `rows` are the seven rows y−3 … y+3, each readable from −4 to
/// width + 3; planes[p][0 … width).
struct CensusRow {
  const std::uint8_t* rows[7];
  std::uint8_t* planes[kPlanes];
  int width;
};

/// Costs of one row: cost[x · padded + k] for disparity min + k. right[p] points at the mirrored pixel of x = 0,
/// d = min, so pixel x, index k reads right[p][k − x].
struct CostRow {
  const std::uint8_t* left[kPlanes];
  const std::uint8_t* right[kPlanes];
  std::uint8_t* cost;
  int width, padded;
};

/// One pixel of one pass: path costs are updated in place,
///   L(d) = C(d) + min(L'(d), L'(d−1) + p1, L'(d+1) + p1, min L' + p2) − min L'   (Hirschmüller, PAMI 2008, eq. 13)
/// where L' is what the slot `from` holds. The sum of the four goes to `sum` (+ `add` where it is not null).
struct PixelPaths {
  const std::uint8_t* cost;
  const std::uint8_t* from[kPaths];
  std::uint8_t* to[kPaths];
  std::uint8_t from_min[kPaths];
  std::uint8_t p2[kPaths];
  std::uint8_t p1;
  const std::uint16_t* add;
  std::uint16_t* sum;
  int padded;
};
struct PathMinima {
  std::uint8_t of[kPaths];
};

/// Smallest of `count` sums and the smallest of those not next to it.
struct Winner {
  int index;
  std::uint16_t best, runner_up;
};

struct Kernels {
  void (*census_row)(const CensusRow&);
  void (*cost_row)(const CostRow&);
  PathMinima (*pixel_paths)(const PixelPaths&);
  Winner (*find_winner)(std::uint16_t* sums, int count, int padded);
};

/// The kernels of one instruction set; see simd_target_index().
Kernels kernels_for(std::size_t target_index);

}  // namespace spartan::sgm
