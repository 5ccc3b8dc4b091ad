// Disparities without texture in their surroundings: the smoothness of the matching has carried them there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"

namespace spartan::internal::matching {

inline constexpr int kGradientStep = 4;  ///< Pixels per sample of GradientVariances, in both directions.

/// Variances of the gradients in the windows of the fit (GradientVarianceRow) at the centres of cells of kGradientStep²
/// pixels; NaN where the disparity of the centre is unknown.
struct GradientVariances {
  ImageView<const float> mean;        ///< var(g)
  ImageView<const float> difference;  ///< var(q)
};

/// Outlier probability of disparities that no texture supports, as those of a sky that has got the disparity of a rock
/// before it, in both images alike, so that the left-right check agrees. A cell is supported where the gradients of
/// both images are correlated in the 13×13 cells around it, weighted by how little their contrast exceeds that of the
/// noise:
///   Σ w (var(g) − var(q)) / (var(g) + var(q)) ≥ 0.08 Σ w,  w = min(1, 2 σ_q² / (var(g) + var(q)))²,
/// where the noise σ_q² is the lower quartile of var(q) over the image. In the other cells the outlier probability is
/// at least 50 % at pixels that have no contrast above the noise around them in the left image, and at pixels of their
/// gray level up to 3 px away.
class TextureSupport {
 public:
  /// Raises outlier probabilities. `marks` is overwritten; it has the size of the images.
  void assess(const GradientVariances& gradients, ImageView<const std::uint8_t> left, ImageView<std::uint8_t> marks,
              const ThreadPool& workers, ImageView<std::uint8_t> outlier_percent);
  std::size_t buffer_bytes() const;
  /// An upper bound of buffer_bytes().
  static std::int64_t memory_bytes(ImageSize size);

 private:
  void score(const GradientVariances& gradients, float noise);
  bool find_unsupported(ImageSize cells);

  std::vector<float> samples_;             // of var(q)
  std::vector<float> scores_, columns_;    // of the cells, and sums of their columns
  std::vector<std::uint8_t> unsupported_;  // cells: 1 or 0
};

}  // namespace spartan::internal::matching
