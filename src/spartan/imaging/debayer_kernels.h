// The inner loops of debayering, one version per instruction set. They are plain loops over rows that the compiler
// vectorises for each; colours leave them as three rows that are interleaved, or reduced to luma, at the end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/imaging/bayer_pattern.h"

namespace spartan::bayer {

/// One row of the mosaic between its neighbours, for bilinear interpolation.
template <class T>
struct BilinearRow {
  const T *above, *here, *below;
  int width;
  bool red_row;
  bool green_first;  ///< at column 0
};

/// Rows of integers around the row at work, in rings: what a band of the edge-aware method needs at a time.
class BandMemory {
 public:
  enum Plane {
    mosaic,
    across,
    upright,
    step_across,
    step_upright,
    sum_across,
    sum_upright,
    green,
    difference,
    to_red,
    to_blue
  };
  static constexpr int kPlanes = 11;
  static constexpr int kRing = 8;    ///< rows
  static constexpr int kMargin = 8;  ///< columns on either side

  /// For mosaics of this width.
  explicit BandMemory(int width);
  int width() const { return width_; }

  /// Row y (any integer) of a plane, readable and writable from −kMargin to width + kMargin − 1.
  std::int32_t* row(Plane plane, int y) {
    return rows_.data() + (plane * kRing + (y & (kRing - 1))) * stride_ + kMargin;
  }
  /// All bits set at even, or at odd, columns; the same extent.
  const std::int32_t* columns(bool even) const {
    return rows_.data() + (kPlanes * kRing + (even ? 0 : 1)) * stride_ + kMargin;
  }

 private:
  int width_;
  std::ptrdiff_t stride_;
  std::vector<std::int32_t> rows_;
};

/// Rows begin … end of a picture by the edge-aware method (docs/math/imaging.md).
template <class T, class Pixel>
struct Band {
  ImageView<const T> mosaic;
  RedPlace red;
  int full_scale;  ///< the largest sample that the format has
  ImageView<Pixel> result;
  int begin, end;
};

template <class T>
struct Kernels {
  void (*bilinear_colour)(const BilinearRow<T>&, Rgb<T>* out);
  void (*bilinear_luma)(const BilinearRow<T>&, T* out);
  void (*edge_aware_colour)(const Band<T, Rgb<T>>&, BandMemory&);
  void (*edge_aware_luma)(const Band<T, T>&, BandMemory&);
};

/// The kernels of one instruction set; see simd_target_index().
template <class T>
Kernels<T> kernels_for(std::size_t target_index);

}  // namespace spartan::bayer
