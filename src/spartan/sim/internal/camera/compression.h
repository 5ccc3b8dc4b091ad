// What lossy compression leaves of an image.
#pragma once

#include "spartan/core/frame_image.h"

namespace spartan::sim::internal {

/// The image as it is read again from a JPEG file of a quality from 1 to 100. 8-bit gray.
FrameImage compressed_by_jpeg(const FrameImage& image, int quality);

/// The same by wavelets with about this number of bits per pixel: JPEG 2000, whose wavelet transform and progressive
/// coding of bit planes are those of ICER, the compressor of the Mars rovers (Kiely and Klimesh, IPN Progress Report
/// 42-155, 2003). 8-bit gray.
FrameImage compressed_by_wavelets(const FrameImage& image, double bits_per_pixel);

}  // namespace spartan::sim::internal
