// Search for the calibration hypothesis that explains the matches of an image pair.
#pragma once

#include <vector>

#include "spartan/calibration/internal/pair_hypothesis.h"
#include "spartan/calibration/internal/pair_refinement.h"

namespace spartan::internal {

/// A hypothesis with its small correction estimated from the matches.
struct FittedHypothesis {
  PairHypothesis hypothesis;
  std::vector<PixelMatch> matches;  ///< left and right as the hypothesis assigns the images
  PairFit fit;                      ///< of the parameters that the hypothesis leaves free
  bool rows_good = false;           ///< the rows are good without the correction of the fit
  bool uncorrected = false;         ///< the rows agree as well without the correction of the fit
  double cost = 0;                  ///< of the uncorrected rows, or of the corrected rows with a penalty per match
  int saturated = 0;                ///< matches of maximum row cost: outliers under this hypothesis
  double negative_share = 0;        ///< share of the inliers with negative disparity, at most a small yaw applied
  bool consistent = false;          ///< most rows agree, with positive disparities
  /// Consistent, and the correction is within the limits of the prior. Where not, no known error explains the images.
  bool accepted = false;
  bool sides_unambiguous = true;  ///< false: equal cameras; an inverse transform and swapped cameras are equivalent
  bool size_unambiguous = true;   ///< false: the inverse size factor on the other camera fits as well
  /// Mean absolute row error of the inliers, px: with the calibration as given (the right camera on the right; NaN
  /// where its models cannot unproject the matches), and with the hypothesis, corrected unless `uncorrected`.
  double nominal_rows_px = 0, rows_px = 0;
};

/// Greedy hypothesis search. Starts with the calibration as given (scaled to the image size where that is known). While
/// rows or signs of disparities disagree, it tries one further error at a time: inverse transform, swapped cameras,
/// camera models or images, focal lengths of another image size for one or both cameras, missing radial distortion, and
/// a vertical shift where no typical correction suffices. All hypotheses are fitted to the same matches. The cheapest
/// one replaces a simpler one where its cost is clearly lower; a correction costs a fixed penalty per match, so that a
/// hypothesis whose rows agree uncorrected counts as simpler. A hypothesis under which most disparities are negative is
/// rejected. `calibrated`: false where the camera models are guessed; then sizes are not tested.
FittedHypothesis find_hypothesis(const Camera& left, const Camera& right, const Pose& left_from_right,
                                 const std::vector<PixelMatch>& matches, ImageSize image_size, bool calibrated = true);

PairFitOptions fit_options(const PairHypothesis& hypothesis);

}  // namespace spartan::internal
