// The inner loop of the rectification, one version per instruction set.
//
// Neighbours in the rectified view look at neighbours in the source. So eight pixels of a row share a block: they are
// fetched by one 16-byte load a source row and a byte shuffle, where a gather would take sixteen loads. That is for
// gray of 8 bits; of the other kinds of pixels a load brings two neighbours with all their channels.
#pragma once

#include <cstddef>
#include <cstdint>

#include "spartan/core/image.h"

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

template <class Pixel>
struct Source {
  const Pixel* data;
  std::ptrdiff_t stride;
  int width, height;
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

template <class T>
T between(const T& s00, const T& s10, const T& s01, const T& s11, int part_x, int part_y) {
  return static_cast<T>(interpolate(s00, s10, s01, s11, part_x, part_y));
}
template <class T>
Rgb<T> between(const Rgb<T>& s00, const Rgb<T>& s10, const Rgb<T>& s01, const Rgb<T>& s11, int part_x, int part_y) {
  return {between(s00.r, s10.r, s01.r, s11.r, part_x, part_y), between(s00.g, s10.g, s01.g, s11.g, part_x, part_y),
          between(s00.b, s10.b, s01.b, s11.b, part_x, part_y)};
}

/// The plain way: between the four samples at a place.
template <class Pixel>
Pixel sample(const Source<Pixel>& source, Place place, int part_x, int part_y) {
  const Pixel* const p = source.data + place.y * source.stride + place.x;
  const Pixel* const q = place.y + 1 < source.height ? p + source.stride : p;
  return between(p[0], p[1], q[0], q[1], part_x, part_y);
}

/// Of a pixel that is seen and not in a scattered block.
inline Place place_of(const Cell& cell, int at) {
  const Place corner = cell.corners[at / kBlock];
  return {static_cast<std::int16_t>(corner.x + (cell.codes[at] & 15)),
          static_cast<std::int16_t>(corner.y + (cell.codes[at] >> 4))};
}

/// Fill `width` pixels of a row of the result from the cells of the table's row; those of scattered blocks become 0.
/// `ahead`: the cells of a row that comes soon, whose source is asked of the memory meanwhile. A view that is turned
/// goes from source row to source row, which the processor does not foresee.
struct Kernels {
  void (*gray8)(const Cell* cells, const Cell* ahead, int width, const Source<std::uint8_t>& source, std::uint8_t* out);
  void (*gray16)(const Cell* cells, const Cell* ahead, int width, const Source<std::uint16_t>& source,
                 std::uint16_t* out);
  void (*colour8)(const Cell* cells, const Cell* ahead, int width, const Source<Rgb8>& source, Rgb8* out);
  void (*colour16)(const Cell* cells, const Cell* ahead, int width, const Source<Rgb16>& source, Rgb16* out);
};

/// The kernels of one instruction set; see simd_target_index().
Kernels kernels_for(std::size_t target_index);

}  // namespace spartan::remap
