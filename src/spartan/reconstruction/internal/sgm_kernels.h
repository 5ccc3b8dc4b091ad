// Kernels of census matching and semi-global aggregation, one version per SIMD instruction set.
//
// A census signature has 62 bits in 8 byte planes: bit b of plane p is set where neighbour 8p + b of the 9×7 window is
// darker than the centre (Zabih & Woodfill, ECCV 1994). The matching cost of (x, d) is the Hamming distance between the
// left signature at x and the right signature at x − d. Right planes are stored mirrored, so that increasing d runs
// forward in memory.
#pragma once

#include <cstddef>
#include <cstdint>

namespace spartan::internal::sgm {

inline constexpr int kPlanes = 8;
inline constexpr int kCensusBits = 62;
inline constexpr int kPaths = 4;             ///< Paths of one pass; the other pass has the opposite four.
inline constexpr int kGuard = 64;            ///< Bytes before and after each path slot, always kNever.
inline constexpr std::uint8_t kNever = 255;  ///< Cost of the padding disparities that fill up a vector.

/// The neighbour that a bit of the signature compares with the centre: row 0 … 6 (3: the centre's), column −4 … 4.
struct Neighbour {
  int row, column;
};
constexpr Neighbour census_neighbour(int bit) {
  const int at = bit < 31 ? bit : bit + 1;
  return {at / 9, at % 9 - 4};
}

/// Census transform of one row: `rows` are the seven image rows y−3 … y+3, each readable from −4 to width + 3; the
/// result is planes[p][0 … width).
struct CensusRow {
  const std::uint8_t* rows[7];
  std::uint8_t* planes[kPlanes];
  int width;
};

/// Matching costs of one row: cost[x · padded + k] for disparity min + k. right[p] points at the mirrored pixel of x =
/// 0, d = min, so that pixel x and index k read right[p][k − x].
struct CostRow {
  const std::uint8_t* left[kPlanes];
  const std::uint8_t* right[kPlanes];
  std::uint8_t* cost;
  int width, padded;
};

/// Aggregation at one pixel of one pass: the path costs are updated in place,
///   L(d) = C(d) + min(L'(d), L'(d−1) + p1, L'(d+1) + p1, min L' + p2) − min L'   (Hirschmüller, PAMI 2008, eq. 13)
/// where L' are the costs of the previous pixel of the path, in the slot `from`. `sum` receives the sum over the four
/// paths, plus `add` where it is not null.
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

struct Kernels {
  void (*census_row)(const CensusRow&);
  void (*cost_row)(const CostRow&);
  PathMinima (*pixel_paths)(const PixelPaths&);
  int (*find_winner)(const std::uint16_t* sums, int padded);  ///< Index of the smallest sum, the first of equal ones.
};

/// The kernels of one instruction set; see simd_target_index().
Kernels kernels_for(std::size_t target_index);

}  // namespace spartan::internal::sgm
