// Lightly smoothed images in fixed point, for the sub-pixel alignment of patches.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"

namespace spartan::internal {

/// Gray levels times 256 after the binomial filter [1 4 6 4 1]/16 in both directions (σ = 1 px; the weights sum to
/// 256, so nothing is rounded). Smoothing makes bilinear interpolation nearly exact, which keeps the alignment free of
/// a bias towards whole pixels (pixel locking). Border pixels are replicated.
class SmoothedImage {
 public:
  void compute(ImageView<const std::uint8_t> image, const ThreadPool& workers);
  ImageView<const std::uint16_t> view() const { return pixels_; }

 private:
  Image<std::uint16_t> rows_;  ///< filtered along y, times 16
  Image<std::uint16_t> pixels_;
};

}  // namespace spartan::internal
