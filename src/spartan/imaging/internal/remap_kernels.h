// The inner loop of the rectification, compiled once per instruction set.
//
// Neighbouring pixels of the rectified view have neighbouring source positions. Eight pixels of a row form a block: one
// 16-byte load per source row and a byte shuffle fetch their samples, where a gather would take sixteen loads. This
// applies to 8-bit gray. For the other pixel types one load fetches two neighbouring pixels with all their channels.
#pragma once

#include <cstddef>
#include <cstdint>

#include "spartan/core/image.h"

namespace spartan::internal::remap {

inline constexpr int kFractionBits = 7;
inline constexpr int kOne = 1 << kFractionBits;
inline constexpr int kBlock = 8;                 ///< pixels
inline constexpr int kLoad = 16;                 ///< bytes of a source row that a block may read
inline constexpr int kBlocks = 4;                ///< in a cell
inline constexpr int kCell = kBlocks * kBlock;   ///< pixels
inline constexpr int kMaxRowOffset = 7;          ///< largest difference of the top source rows of the pixels of a block
inline constexpr std::uint8_t kInvalid = 0x80;   ///< code of an invalid pixel
inline constexpr std::uint8_t kScattered = 255;  ///< kind of a block whose source pixels are further apart

/// Integer coordinates in the source image, px.
struct SourcePixel {
  std::int16_t x, y;
};

/// 32 pixels of a table row: 128 bytes, two cache lines. A pixel is interpolated between the source pixels (x, y),
/// (x + 1, y), (x, y + 1) and (x + 1, y + 1); below the last source row that row is repeated.
struct Cell {
  std::uint8_t codes[kCell];       ///< kInvalid, or 16 · (y − corner.y) + (x − corner.x); 0 in scattered blocks
  std::uint8_t fraction_x[kCell];  ///< fraction of the column in 1/128 px (128 at the last column)
  std::uint8_t fraction_y[kCell];  ///< fraction of the row in 1/128 px, < 128
  SourcePixel corners[kBlocks];
  std::uint8_t kinds[kBlocks];  ///< source rows that the block needs minus 3, or kScattered
  std::uint8_t unused[12];
};

template <class Pixel>
struct Source {
  const Pixel* data;
  std::ptrdiff_t stride;
  int width, height;
};

/// Bilinear interpolation between four samples:
///   top = 128 s00 + fraction_x (s10 − s00), bottom likewise, level = top + round(fraction_y (bottom − top) / 128),
/// divided by 128 and rounded: at most 0.504 from the exact bilinear value.
inline std::int32_t interpolate(std::int32_t s00, std::int32_t s10, std::int32_t s01, std::int32_t s11, int fraction_x,
                                int fraction_y) {
  constexpr int kHalf = kOne / 2;
  const std::int32_t top = kOne * s00 + fraction_x * (s10 - s00), bottom = kOne * s01 + fraction_x * (s11 - s01);
  return (top + ((fraction_y * (bottom - top) + kHalf) >> kFractionBits) + kHalf) >> kFractionBits;
}

template <class T>
T between(const T& s00, const T& s10, const T& s01, const T& s11, int fraction_x, int fraction_y) {
  return static_cast<T>(interpolate(s00, s10, s01, s11, fraction_x, fraction_y));
}
template <class T>
Rgb<T> between(const Rgb<T>& s00, const Rgb<T>& s10, const Rgb<T>& s01, const Rgb<T>& s11, int fraction_x,
               int fraction_y) {
  return {between(s00.r, s10.r, s01.r, s11.r, fraction_x, fraction_y),
          between(s00.g, s10.g, s01.g, s11.g, fraction_x, fraction_y),
          between(s00.b, s10.b, s01.b, s11.b, fraction_x, fraction_y)};
}

/// Scalar reference: interpolates at a source pixel.
template <class Pixel>
Pixel sample(const Source<Pixel>& source, SourcePixel at, int fraction_x, int fraction_y) {
  const Pixel* const p = source.data + at.y * source.stride + at.x;
  const Pixel* const q = at.y + 1 < source.height ? p + source.stride : p;
  return between(p[0], p[1], q[0], q[1], fraction_x, fraction_y);
}

/// Top-left source pixel of a valid pixel in a block that is not scattered.
inline SourcePixel source_pixel(const Cell& cell, int at) {
  const SourcePixel corner = cell.corners[at / kBlock];
  return {static_cast<std::int16_t>(corner.x + (cell.codes[at] & 15)),
          static_cast<std::int16_t>(corner.y + (cell.codes[at] >> 4))};
}

/// Compute `width` pixels of a result row from the cells of the table row; pixels of scattered blocks become 0.
/// `prefetched`: cells of a later row, whose source pixels are prefetched. A rotated view crosses source rows, which
/// the hardware prefetcher does not predict.
struct Kernels {
  void (*gray8)(const Cell* cells, const Cell* prefetched, int width, const Source<std::uint8_t>& source,
                std::uint8_t* out);
  void (*gray16)(const Cell* cells, const Cell* prefetched, int width, const Source<std::uint16_t>& source,
                 std::uint16_t* out);
  void (*colour8)(const Cell* cells, const Cell* prefetched, int width, const Source<Rgb8>& source, Rgb8* out);
  void (*colour16)(const Cell* cells, const Cell* prefetched, int width, const Source<Rgb16>& source, Rgb16* out);
};

/// The kernels of one instruction set; see simd_target_index().
Kernels kernels_for(std::size_t target_index);

}  // namespace spartan::internal::remap
