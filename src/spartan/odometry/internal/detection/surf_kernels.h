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

/// Rows of the integral image that the boxes of a filter at one row of pixels need, at the first pixel.
struct HessianRows {
  const std::uint32_t *xx_top, *xx_bottom, *yy_top, *yy_upper, *yy_lower, *yy_bottom, *xy_top, *above, *below,
      *xy_bottom;
  int lobe, half, inner;
  float area;
};

/// Samples of a descriptor: 5×5 in each of 4×4 subregions. Positions in units of the scale and weights, sample by
/// sample, all subregions side by side.
inline constexpr int kHaarRegions = 16, kHaarSamples = 25;
struct HaarTable {
  alignas(64) float x[kHaarSamples][kHaarRegions], y[kHaarSamples][kHaarRegions], weight[kHaarSamples][kHaarRegions];
};
const HaarTable& haar_table();

/// Where a descriptor is taken: position, scale s, cosine and sine of its orientation, half of the side of a wavelet.
struct DescriptorPlace {
  float x = 0, y = 0, scale = 0, cosine = 1, sine = 0;
  int half = 1;
};
/// Σdx, Σ|dx|, Σdy, Σ|dy| of the Haar responses in 4×4 subregions (§4.2), by subregion.
std::array<float, 64> haar_sums(const IntegralImage& integral, const DescriptorPlace& place);

/// Samples of an orientation: within 6 scales of the feature, row by row (§4.1); a multiple of the vectors.
inline constexpr int kOrientationSamples = 109, kOrientationRoom = 112;
struct OrientationTable {
  alignas(64) float x[kOrientationRoom], y[kOrientationRoom], weight[kOrientationRoom];
};
const OrientationTable& orientation_table();
struct OrientationResponses {
  alignas(64) float dx[kOrientationRoom], dy[kOrientationRoom];  ///< weighted; 0 behind the last one
};
/// Haar responses of side 4 s around a place, weighted by a Gaussian of 2.5 s. Its orientation is not used; `half` is
/// half of the side of the wavelets.
OrientationResponses orientation_responses(const IntegralImage& integral, const DescriptorPlace& place);

/// Side of a square of pixels that is smoothed, the room of its rows, and the side of the result.
inline constexpr int kSmoothedSide = 9, kMaxGaussianRadius = 17, kSupportSide = kSmoothedSide + 2 * kMaxGaussianRadius,
                     kSupportStride = 64, kSmoothedStride = 16;
/// A Gaussian that is cut off: weights of the middle, of its neighbours, and so on.
struct GaussianKernel {
  int radius = 0;
  float weights[kMaxGaussianRadius + 1] = {};
};
/// Smooths the middle of a square of kSupportSide rows of kSupportStride values, of which kSupportSide count.
void smooth_middle(const float* support, const GaussianKernel& kernel, float* smoothed);

}  // namespace spartan::internal
