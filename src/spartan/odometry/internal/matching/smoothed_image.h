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

/// Bilinear interpolation, in gray levels (not times 256); (x, y) must lie in [0, width − 1) × [0, height − 1).
inline float sample(ImageView<const std::uint16_t> image, float x, float y) {
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const float fx = x - static_cast<float>(ix), fy = y - static_cast<float>(iy);
  const std::uint16_t *top = image.row(iy) + ix, *bottom = image.row(iy + 1) + ix;
  const auto t0 = static_cast<float>(top[0]), t1 = static_cast<float>(top[1]);
  const auto b0 = static_cast<float>(bottom[0]), b1 = static_cast<float>(bottom[1]);
  const float upper = t0 + fx * (t1 - t0), lower = b0 + fx * (b1 - b0);
  return (upper + fy * (lower - upper)) * (1.0f / 256.0f);
}

}  // namespace spartan::internal
