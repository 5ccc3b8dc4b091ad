// Normalized cross-correlation of one small window with all windows along a row.
#pragma once

#include <cstdint>
#include <vector>

#include "spartan/core/image.h"

namespace spartan::internal {

/// Windows are 15 pixels wide and 7 high: low, because the disparity of the ground changes from row to row.
inline constexpr int kCorrelationRadiusX = 7;
inline constexpr int kCorrelationRadiusY = 3;

/// Normalized cross-correlation (Pearson's coefficient) in [−1, 1] of the window around (x, y) of `image` with those
/// around (from … to, y) of `other`, both ends included; −1 where a window has no texture. All windows must lie inside
/// the images. Sums are exact integers.
std::vector<float> correlate_row(ImageView<const std::uint8_t> image, int x, int y, ImageView<const std::uint8_t> other,
                                 int from, int to);

}  // namespace spartan::internal
