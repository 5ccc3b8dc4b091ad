// Colour out of Bayer mosaics: the published sub-module "debayering".
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/core/pixel_format.h"
#include "spartan/core/threads.h"

namespace spartan {

/// Bilinear: a missing colour is the rounded mean of its two or four nearest samples; at the borders the mosaic is
/// mirrored about its outermost samples, which keeps its phase. `result` has the size of `mosaic` (at least 2 × 2) and
/// the same scale. Throws where sizes differ or `layout` is no Bayer pattern.
void debayer(ImageView<const std::uint8_t> mosaic, PixelLayout layout, ImageView<Rgb8> result, const Workers& workers);
void debayer(ImageView<const std::uint16_t> mosaic, PixelLayout layout, ImageView<Rgb16> result,
             const Workers& workers);

/// The luma of the colours that debayer() gives, without storing them.
void debayer(ImageView<const std::uint8_t> mosaic, PixelLayout layout, ImageView<std::uint8_t> result,
             const Workers& workers);
void debayer(ImageView<const std::uint16_t> mosaic, PixelLayout layout, ImageView<std::uint16_t> result,
             const Workers& workers);

/// Luma of a colour (ITU-R BT.601: 0.299 R + 0.587 G + 0.114 B) in 16-bit fixed point, rounded.
template <class T>
T luma(const Rgb<T>& colour) {
  return static_cast<T>((19595U * colour.r + 38470U * colour.g + 7471U * colour.b + 32768U) >> 16U);
}

}  // namespace spartan
