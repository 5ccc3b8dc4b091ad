// How far a disparity image is from the true one.
#pragma once

#include <cstdint>
#include <optional>

#include "spartan/core/image.h"
#include "spartan/core/result.h"

namespace spartan {

/// Over the truth pixels of one kind; a matched pixel is one that has an estimate (a finite value). A figure over
/// no pixel at all is not there.
struct DisparityScores {
  std::int64_t truth_pixels = 0;
  std::int64_t matched_pixels = 0;
  /// Percent of the truth pixels with an error over 0.5, 1, 2, 3 px; holes count as bad.
  std::optional<double> bad_0_5, bad_1, bad_2, bad_3;
  /// Percent of the matched pixels with an error over 1 and 2 px.
  std::optional<double> matched_bad_1, matched_bad_2;
  std::optional<double> density_percent;  ///< matched pixels, percent of the truth pixels
  std::optional<double> rms_in_1px;       ///< px, root mean square over the matched pixels with an error up to 1 px
  std::optional<double> mean_abs_px;      ///< px, over the matched pixels
};

struct DisparityMetrics {
  DisparityScores all;
  std::optional<DisparityScores> nonocc;  ///< only where the mask tells occluded pixels from others
};

/// Values of a truth mask.
constexpr std::uint8_t kMaskSeenByBoth = 255, kMaskOccluded = 128, kMaskNoTruth = 0;

/// Disparities in px, NaN where unknown; an empty mask: every known true disparity counts. Pixels count as truth where
/// it is finite and the mask is not 0. Code `input` where the sizes differ.
Result<DisparityMetrics> compare_disparities(ImageView<const float> estimate, ImageView<const float> truth,
                                             ImageView<const std::uint8_t> mask = {});

}  // namespace spartan
