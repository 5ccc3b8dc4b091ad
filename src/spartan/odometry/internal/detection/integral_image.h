// Sums over upright rectangles in constant time (Viola & Jones, CVPR 2001).
#pragma once

#include <cstdint>

#include "spartan/core/image.h"

namespace spartan::internal {

/// I(x, y) = Σ of the pixels left of x and above y; one column and one row more than the image. Behind the last row
/// there is room that vectors may read. Sums wrap modulo 2³²;
/// their differences are exact as long as the true sum fits (always for 8-bit images of up to 16 megapixels).
class IntegralImage {
 public:
  void compute(ImageView<const std::uint8_t> image);

  /// Size of the summed image.
  int width() const { return size_.width; }
  int height() const { return size_.height; }
  const std::uint32_t* row(int y) const { return sums_.row(y); }

  /// Sum over x0 ≤ x < x1, y0 ≤ y < y1; the rectangle must lie inside the image.
  std::uint32_t box(int x0, int y0, int x1, int y1) const {
    const std::uint32_t *top = row(y0), *bottom = row(y1);
    return bottom[x1] - bottom[x0] - top[x1] + top[x0];
  }
  /// The same with the rectangle clipped to the image.
  std::uint32_t clipped_box(int x0, int y0, int x1, int y1) const;

 private:
  ImageSize size_;
  Image<std::uint32_t> sums_;
};

}  // namespace spartan::internal
