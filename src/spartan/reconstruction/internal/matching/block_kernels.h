// Kernels of block matching, one version per SIMD instruction set. All arithmetic is in integers, so that all versions
// give the same bits.
//
// Rows must be readable and writable for one vector (64 bytes) behind their last pixel.
#pragma once

#include <cstddef>
#include <cstdint>

namespace spartan::internal::matching {

/// min(|left − right|, 31) · 8 of `width` pixels.
struct DifferenceRow {
  const std::uint8_t* left;
  const std::uint8_t* right;  ///< Of the pixel x: right[x].
  std::uint8_t* difference;
  int width;
};

/// (a + 2 b + c) / 4 of `width` pixels: the binomial weights of one step of a Gaussian filter, rounded up.
struct AverageRow {
  const std::uint8_t *a, *b, *c;
  std::uint8_t* average;
  int width;
};

/// What the planes so far have given for the pixels of a row. 255 is no cost.
struct PlaneRow {
  std::uint8_t* best;      ///< smallest cost of the planes
  std::uint8_t* before;    ///< cost of the plane before that one, 255: none
  std::uint8_t* after;     ///< cost of the plane after it, 255: none yet
  std::uint8_t* previous;  ///< cost of the last plane
  std::uint16_t* index;    ///< of the plane with the smallest cost
};

/// Compares the costs of one plane with those of the planes before it, for the pixels of the left image, and for those
/// of the right image that they match. On a tie the plane that came first is kept.
struct PlaneUpdate {
  const std::uint8_t* cost;
  PlaneRow left;
  std::uint8_t* right_best;    ///< Of the pixel x: right_best[x].
  std::uint16_t* right_index;  ///< As right_best.
  int width;
  int index;  ///< of the plane
};

struct BlockKernels {
  void (*difference_row)(const DifferenceRow&);
  void (*average_row)(const AverageRow&);
  void (*update_row)(const PlaneUpdate&);
};

/// The kernels of one instruction set; see simd_target_index().
BlockKernels block_kernels_for(std::size_t target_index);

}  // namespace spartan::internal::matching
