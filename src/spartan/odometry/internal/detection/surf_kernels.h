// Inner loops of SURF, compiled for each instruction set.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "spartan/odometry/internal/detection/integral_image.h"

namespace spartan::internal {

/// Values that hessian_row() may write and maxima_of_row() may read behind a row.
inline constexpr int kSurfPadding = 16;

/// det H of one filter size at the pixels x0, x0 + step, … of a row: Dxx Dyy − (0.9 Dxy)² by box filters, over the
/// square of the filter's area (Bay et al., §3.2). The filters must lie inside the image with a margin of one pixel.
void hessian_row(const IntegralImage& integral, int y, int x0, int count, int filter_px, int step, float* out);

/// Appends the columns from `first` to `last` where the response exceeds the threshold and its four neighbours.
void maxima_of_row(const float* above, const float* row, const float* below, int first, int last, float threshold,
                   std::vector<int>& columns);

/// Where a descriptor is taken: position, scale s, cosine and sine of its orientation, half of the side of a wavelet.
struct DescriptorPlace {
  float x = 0, y = 0, scale = 0, cosine = 1, sine = 0;
  int half = 1;
};
/// Σdx, Σ|dx|, Σdy, Σ|dy| of the Haar responses in 4×4 subregions (§4.2), by subregion.
std::array<float, 64> haar_sums(const IntegralImage& integral, const DescriptorPlace& place);

}  // namespace spartan::internal
