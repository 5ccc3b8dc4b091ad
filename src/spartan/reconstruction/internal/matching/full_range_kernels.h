// Kernels of semi-global matching over all disparities of a range, one version per SIMD instruction set.
//
// A pixel has `levels` costs: those of the disparities min, min + 1 …, then kNever up to a multiple of kLevelStep, at
// least one. Path costs are stored before the subtraction of their minimum, which is stored beside them, so that the
// levels behind the range stay kNever and need no guard: level −1 of a pixel is the last level of the pixel before.
//
// Rows must be readable and writable for one vector (64 bytes) behind their last level, readable for one pixel before.
#pragma once

#include <cstddef>
#include <cstdint>

#include "spartan/reconstruction/internal/matching/interval_kernels.h"

namespace spartan::internal::matching {

inline constexpr int kLevelStep = 32;

/// Matching costs of one row. right[p] points at the mirrored pixel of x = 0 and disparity min: pixel x and level k
/// read right[p][k − x].
struct FullCostRow {
  const std::uint8_t* left[kPlanes];
  const std::uint8_t* right[kPlanes];
  std::uint8_t* cost;
  int width, levels;
};

/// As VerticalRow: path costs of the three paths that enter a row from the row before. `from_min` holds the minimum of
/// the levels in `from` of each pixel, `to_min` receives that of `to`.
struct FullVerticalRow {
  const std::uint8_t* cost;
  const std::uint8_t* p2[3];
  const std::uint8_t* from[3];
  const std::uint8_t* from_min[3];
  std::uint8_t* to[3];
  std::uint8_t* to_min[3];
  std::uint16_t* sum;
  int width, levels;
  std::uint8_t p1;
  bool add;
};

/// The two paths along the rows, of kRowsAtOnce rows. Adds the sum of both paths to `sum`. Rows may be repeated where
/// fewer are left, with a `sum` that nothing reads. `slots` holds 2 · kRowsAtOnce times the levels of a pixel and its
/// guards (kLevelStep bytes on both sides); it is overwritten.
struct FullHorizontalRows {
  const std::uint8_t* cost[kRowsAtOnce];
  const std::uint8_t* p2_from_left[kRowsAtOnce];
  const std::uint8_t* p2_from_right[kRowsAtOnce];
  std::uint16_t* sum[kRowsAtOnce];
  std::uint8_t* slots;
  int width, levels;
  std::uint8_t p1;
};
constexpr std::size_t slot_bytes(int levels) {
  return static_cast<std::size_t>(levels) + 2 * kLevelStep;
}

struct FullRangeKernels {
  void (*cost_row)(const FullCostRow&);
  void (*vertical_row)(const FullVerticalRow&);
  void (*horizontal_rows)(const FullHorizontalRows&);
  int (*find_winner)(const std::uint16_t* sums, int levels);  ///< Index of the smallest sum, the first of equal ones.
};

/// The kernels of one instruction set; see simd_target_index().
FullRangeKernels full_range_kernels_for(std::size_t target_index);

}  // namespace spartan::internal::matching
