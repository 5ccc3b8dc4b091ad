// Errors of a disparity image against ground truth.
#pragma once

#include <cstdint>
#include <optional>

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

}  // namespace spartan
