// Errors of a disparity image against ground truth.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "spartan/core/image.h"
#include "spartan/core/result.h"

namespace spartan {

/// Scores over the truth pixels of one kind. A matched pixel has an estimate (a finite value). A score over no pixels
/// is std::nullopt.
struct DisparityScores {
  std::int64_t truth_pixels = 0;
  std::int64_t matched_pixels = 0;
  /// Percent of the truth pixels with an error above 0.5, 1, 2, 3 px; pixels without an estimate count as bad.
  std::optional<double> bad_0_5, bad_1, bad_2, bad_3;
  /// Percent of the matched pixels with an error above 1 and 2 px.
  std::optional<double> matched_bad_1, matched_bad_2;
  std::optional<double> density_percent;  ///< matched pixels, percent of the truth pixels
  std::optional<double> rms_in_1px;       ///< px, root mean square over the matched pixels with an error up to 1 px
  std::optional<double> mean_abs_px;      ///< px, mean absolute error of the matched pixels
};

struct DisparityMetrics {
  DisparityScores all;
  std::optional<DisparityScores> nonocc;  ///< pixels that both cameras see; only with a mask
};

/// Values of a truth mask: seen by both cameras, occluded in the right image, without truth.
constexpr std::uint8_t kMaskSeenByBoth = 255, kMaskOccluded = 128, kMaskNoTruth = 0;

/// Compares disparities in px, NaN where unknown. Truth pixels are those with a finite true disparity and a mask that
/// is not 0; an empty mask accepts all. Fails with code `input` where the sizes differ.
Result<DisparityMetrics> compare_disparities(ImageView<const float> estimate, ImageView<const float> truth,
                                             ImageView<const std::uint8_t> mask = {});

/// Reads disparities in px, NaN where unknown. The format is recognized by the content of the file:
/// - PFM: values as they are; inf is unknown.
/// - 16-bit PNG: value / 256; 0 is unknown (KITTI).
/// - 8-bit PNG (gray, or RGB with equal channels): value / `scale_of_8_bit`; 0 is unknown (Middlebury).
/// Fails with code `input` for anything else, `usage` where the scale is not positive.
Result<Image<float>> read_disparity(const std::string& path, double scale_of_8_bit = 1);

/// Reads a mask: 255 seen by both cameras, 128 occluded in the right image, 0 without truth. Fails with code `input` on
/// other values.
Result<Image<std::uint8_t>> read_truth_mask(const std::string& path);

}  // namespace spartan
