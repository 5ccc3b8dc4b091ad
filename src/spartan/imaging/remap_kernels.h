// The inner loop of the rectification, one version per instruction set.
//
// Neighbours in the rectified view look at neighbours in the source. So eight pixels of a row share a block: they are
// fetched by one 16-byte load a source row and a byte shuffle, where a gather would take sixteen loads.
#pragma once

#include <cstddef>
#include <cstdint>

namespace spartan::remap {

inline constexpr int kFractionBits = 7;
inline constexpr int kOne = 1 << kFractionBits;
inline constexpr int kBlock = 8;                 ///< pixels
inline constexpr int kLoad = 16;                 ///< bytes of a source row that a block may look at
inline constexpr int kBlocks = 4;                ///< of a cell
inline constexpr int kCell = kBlocks * kBlock;   ///< pixels
inline constexpr int kLargestStep = 7;           ///< rows between the first and the last that a block's pixels start on
inline constexpr std::uint8_t kUnseen = 0x80;    ///< code of a pixel without a place
inline constexpr std::uint8_t kScattered = 255;  ///< kind of a block whose pixels look further apart

/// A place in the source, px.
struct Place {
  std::int16_t x, y;
};

/// 32 pixels of a row of the table: 128 bytes, two cache lines. A pixel looks at (x, y), (x + 1, y), (x, y + 1) and (x
/// + 1, y + 1), where the last source row also stands for the one below it.
struct Cell {
  std::uint8_t codes[kCell];   ///< kUnseen, or 16 · (y − corner.y) + (x − corner.x); 0 in scattered blocks
  std::uint8_t part_x[kCell];  ///< how far beyond x, in 1/128 px (128 at the last column)
  std::uint8_t part_y[kCell];  ///< how far beyond y, below 128
  Place corners[kBlocks];
  std::uint8_t kinds[kBlocks];  ///< source rows beyond three that the block needs, or kScattered
  std::uint8_t unused[12];
};

struct Source {
  const std::uint8_t* data;
  std::ptrdiff_t stride;
  int height;
};

/// From four samples:
///   top = 128 s00 + part_x (s10 − s00), bottom likewise, level = top + round(part_y (bottom − top) / 128),
/// and that by 128, rounded: at most 0.504 from the exact value between the samples.
inline std::int32_t interpolate(std::int32_t s00, std::int32_t s10, std::int32_t s01, std::int32_t s11, int part_x,
                                int part_y) {
  constexpr int kHalf = kOne / 2;
  const std::int32_t top = kOne * s00 + part_x * (s10 - s00), bottom = kOne * s01 + part_x * (s11 - s01);
  return (top + ((part_y * (bottom - top) + kHalf) >> kFractionBits) + kHalf) >> kFractionBits;
}

/// Fills `width` pixels of a row of the result; those of scattered blocks become 0.
using RowKernel = void (*)(const Cell* cells, int width, const Source& source, std::uint8_t* out);

/// The kernel of one instruction set; see simd_target_index().
RowKernel row_kernel_for(std::size_t target_index);

}  // namespace spartan::remap
