// Kernels of the sub-pixel refinement, one version per SIMD instruction set. All arithmetic is integer or single
// floating-point operations without contraction, so that all versions give the same bits.
//
// Rows must be readable and writable for one vector (64 bytes) behind their last pixel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace spartan::internal::matching {

inline constexpr int kFitRadius = 3;  ///< Half size of the window of the fit on intensities.

/// One row of a smoothing by pairs of opposite neighbours: at ±(step, 0), ±(0, step), ±(step, step), ±(step, −step).
/// The mean of a pair is an estimate of the disparity that no slope biases. A pair counts where it fits the pixel,
///   ½ |d₁ + d₂ − 2 d₀| < t,  t = min(tolerance, max(least_tolerance, sigmas · σ₀)),  σ₀ = 1/√w₀,
/// with weight 2 min(w₁, w₂), where w are informations (1/σ²).
struct SmoothRow {
  const float* disparity[3];  ///< Rows y − step, y, y + step, readable for `step` pixels on both sides; NaN: unknown.
  const float* information[3];  ///< px⁻², above 0 where the disparity is known.
  float* smoothed;
  float* smoothed_information;  ///< w₀ + growth · (Σ w of the pairs that count).
  int width;
  int step;
  float tolerance, least_tolerance, sigmas, growth;
};

/// The right image at x − d, by cubic interpolation (Catmull & Rom), and its derivative by the disparity. Where d is
/// unknown or x − d is not in [1, width − 2), all values are 0.
struct WarpRow {
  const std::uint8_t* left;   ///< Readable from −1 to width.
  const std::uint8_t* right;  ///< Readable from 0 to width + 2.
  const float* disparity;
  std::int16_t* known;       ///< 1 or 0
  std::int16_t* gray;        ///< Left image, 1/16 gray level.
  std::int16_t* warped;      ///< Right image, 1/16 gray level.
  std::int16_t* gradient;    ///< ∂(warped)/∂d, mean of both images, 1/8 gray level per pixel.
  std::int16_t* difference;  ///< Half of its difference between the images, 1/8 gray level per pixel.
  int width;
};

/// Sums that the fit needs, of n pixels with gray level l, warped right image r and gradient g.
enum FitSum { kN, kL, kR, kG, kQ, kLL, kLR, kRR, kLG, kRG, kGG, kQQ, kFitSums };

/// Adds one row to the sums of the columns and subtracts another; null: none.
struct ColumnUpdate {
  struct Row {
    const std::int16_t *known, *gray, *warped, *gradient, *difference;
  };
  const Row* add;
  const Row* subtract;
  std::array<std::int32_t*, kFitSums> columns;
  int width;
};

/// Least squares on intensities in the window around each pixel, l ≈ G r + O + k g δ, with gain G and offset O solved
/// and δ held near 0 by a prior of standard deviation σ_p. k = 2G / (1 + G), because g is the mean gradient of r and l:
///   h = k² n var(g),  b = k n (cov(g, l) − G cov(g, r)),  δ = b / (h + s²/σ_p²),
/// where s² is the mean squared residual, at least the squared noise. Adds δ to the disparity. The information is
///   w = t + 1/σ_p²,  t = k² n cov(g_l, g_r) / s²,  cov(g_l, g_r) = var(g) − var(q)
/// with half the difference q of the gradients g_l and g_r of both images: noise has gradients, too, but they have
/// nothing in common.
struct FitRow {
  std::array<const std::int32_t*, kFitSums> columns;  ///< Readable for kFitRadius elements on both sides, which are 0.
  float* disparity;
  float* information;      ///< w, px⁻²
  std::uint8_t* textured;  ///< 1 where t ≥ least_texture and g_l and g_r are correlated, else 0.
  int width;
  float noise_levels;   ///< Smallest residual, gray levels.
  float prior_px;       ///< σ_p
  float least_texture;  ///< px⁻²
  float least_correlation;
};

/// Variances of the gradients in the windows of the fit around the pixels of a row: of the mean g of both images, and
/// of half of their difference q, (gray levels per pixel)². Texture is in g, noise is in both.
struct GradientVarianceRow {
  std::array<const std::int32_t*, kFitSums> columns;  ///< As those of FitRow.
  float* mean;                                        ///< var(g)
  float* difference;                                  ///< var(q)
  int width;
};

/// Median of the 3×3 pixels around the pixels 1 … width − 2 of a row; NaN where one of the nine is NaN. Reads and
/// writes the row's own pixels only. Returns whether there is a NaN.
struct MedianRow {
  const float* rows[3];  ///< Above, at and below the row.
  float* median;
  int width;
};

/// Relief of the surface around the pixels of a row, what a window of the fit or a smoothing cannot follow:
///   ρ² = c₄² + ¼ c₈²,  c_s² the mean of min(1, ½ |d₁ + d₂ − 2 d₀|)² over the known pairs of opposite neighbours at
/// the step s, in the four directions of SmoothRow.
struct ReliefRow {
  static constexpr int kSteps[2] = {4, 8};
  const float* above[2];  ///< Rows y − step, readable for `step` pixels on both sides; NaN: unknown.
  const float* below[2];  ///< Rows y + step
  const float* disparity;
  float* relief;  ///< ρ², px²; where no pair is known as of second differences of half a pixel.
  int width;
};

/// Outlier probability and sigma of the pixels of a row, from the information w of the fit, the relief ρ and the right
/// distance a:
///   logit p = offset + distance log₂(1 + a) + information log₂ w + relief log₂(ρ² + 0.1²),
///   σ² = V / (1 + V / most²),  V = (scale / w)² + relief_scale² ρ² + floor².
/// log₂ is linear between powers of two (within 0.09), 2ˣ between whole x. Disparities with a probability above
/// most_percent become NaN. Rows as those of Image: padded to 64 bytes.
struct ReliabilityModel {
  float offset, distance, information, relief;  // logit of the outlier probability
  float reliable_percent;
  float scale, relief_scale, floor_px, most_px;  // sigma; the scale in px⁻¹
};
struct ReliabilityRow {
  const float* information;            ///< px⁻²
  const float* relief;                 ///< ρ², px²
  const std::uint8_t* right_distance;  ///< px
  float* disparity;
  float* sigma;  ///< px
  std::uint8_t* outlier_percent;
  std::uint8_t* reliable;  ///< 1 where the window of the fit has texture; becomes 0 where p > reliable_percent.
  int width;
  float most_percent;
  ReliabilityModel model;
};

struct RefinementKernels {
  bool (*median_row)(const MedianRow&);
  void (*smooth_row)(const SmoothRow&);
  void (*warp_row)(const WarpRow&);
  void (*update_columns)(const ColumnUpdate&);
  void (*fit_row)(const FitRow&);
  void (*gradient_variance_row)(const GradientVarianceRow&);
  void (*relief_row)(const ReliefRow&);
  void (*reliability_row)(const ReliabilityRow&);
};

/// The kernels of one instruction set; see simd_target_index().
RefinementKernels refinement_kernels_for(std::size_t target_index);

}  // namespace spartan::internal::matching
