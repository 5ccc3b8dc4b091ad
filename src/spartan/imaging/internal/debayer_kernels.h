// The inner loops of debayering, compiled once per instruction set: plain loops over rows that the compiler vectorises.
// They produce rows of red, green and blue, which are finally interleaved or reduced to luma.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/imaging/internal/bayer_pattern.h"

namespace spartan::internal::bayer {

/// One row of the mosaic with the rows above and below, for bilinear interpolation.
template <class T>
struct BilinearRow {
  const T *above, *here, *below;
  int width;
  bool red_row;
  bool green_first;  ///< green at column 0
};

/// Ring buffers of the rows around the current one that the edge-aware method needs.
class BandBuffers {
 public:
  enum Plane {
    mosaic,
    horizontal,           ///< green − other colour, interpolated along the row
    vertical,             ///< green − other colour, interpolated along the column
    row_gradient,         ///< |central difference| of `horizontal` along the row
    column_gradient,      ///< |central difference| of `vertical` along the column
    row_gradient_sum,     ///< over 3 × 3
    column_gradient_sum,  ///< over 3 × 3
    green,
    difference,  ///< green − the mosaic's sample
    green_minus_red,
    green_minus_blue
  };
  static constexpr int kPlanes = 11;
  static constexpr int kRing = 8;    ///< rows
  static constexpr int kMargin = 8;  ///< columns on either side

  /// Allocates buffers for mosaics of this width.
  explicit BandBuffers(int width);
  int width() const { return width_; }

  /// Row y (any integer) of a plane, valid for columns −kMargin … width + kMargin − 1.
  std::int32_t* row(Plane plane, int y) {
    return rows_.data() + (plane * kRing + (y & (kRing - 1))) * stride_ + kMargin;
  }
  /// Column mask with all bits set at even (or odd) columns; valid for the same columns.
  const std::int32_t* columns(bool even) const {
    return rows_.data() + (kPlanes * kRing + (even ? 0 : 1)) * stride_ + kMargin;
  }

 private:
  int width_;
  std::ptrdiff_t stride_;
  std::vector<std::int32_t> rows_;
};

/// Rows begin … end − 1 of an image for the edge-aware method (docs/math/imaging.md).
template <class T, class Pixel>
struct Band {
  ImageView<const T> mosaic;
  BayerPhase phase;
  int full_scale;  ///< largest sample of the format
  ImageView<Pixel> result;
  int begin, end;
};

template <class T>
struct Kernels {
  void (*bilinear_colour)(const BilinearRow<T>&, Rgb<T>* out);
  void (*bilinear_luma)(const BilinearRow<T>&, T* out);
  void (*edge_aware_colour)(const Band<T, Rgb<T>>&, BandBuffers&);
  void (*edge_aware_luma)(const Band<T, T>&, BandBuffers&);
};

/// The kernels of one instruction set; see simd_target_index().
template <class T>
Kernels<T> kernels_for(std::size_t target_index);
template <>
Kernels<std::uint8_t> kernels_for(std::size_t target_index);
template <>
Kernels<std::uint16_t> kernels_for(std::size_t target_index);

}  // namespace spartan::internal::bayer
