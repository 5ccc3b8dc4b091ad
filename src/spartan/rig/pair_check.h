// Judging the calibration of a stereo pair by pictures that it took.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "spartan/rig/pair_refinement.h"
#include "spartan/rig/rig.h"
#include "spartan/rig/rig_findings.h"
#include "spartan/rig/row_errors.h"

namespace spartan {

enum class PairVerdict {
  good,    ///< rows agree to 0.5 px in the mean and 1.5 px for 95 %, and nothing is found
  usable,  ///< to 1 px and 3 px: stereo works and loses some; or the pictures show too little to judge
  bad,
};
std::string_view name_of(PairVerdict verdict);

struct PairCheck {
  int matches = 0, inliers = 0;  ///< inliers fit the corrected pair
  /// Of the inliers: rows in the pictures as taken; in the rectified view of the pair as given (but for eyes, transform
  /// and picture size that were found wrong: with those no row means anything); of the corrected one (`corrected`).
  RowErrors as_taken, as_given, as_corrected;
  std::vector<RowErrorCell> map;     ///< 8 x 6 cells over the left picture, those with at least 3 matches
  PairCorrection correction, sigma;  ///< sigma of yaw: with what a lens can do that looks like it (0.3°)
  std::vector<RigFinding> findings;
  PairVerdict verdict = PairVerdict::bad;
  std::vector<PixelMatch> matched;   ///< the inliers, for pictures
  std::vector<double> row_error_px;  ///< of them, as given
  /// The rig with everything taken in that was found: eyes, transform, unit, turns, baseline, focal length, distortion.
  /// The yaw only where it is found wrong.
  Rig corrected;
};

/// `matches`: of one or more shots; a share of them may be wrong. `picture_size`: of the pictures they come from.
/// Beside the findings of find_doubts(): `inverse_transform` or `swapped_eyes` by the sign of the disparities,
/// `size_mismatch` where another picture size makes the rows agree, `distortion_ignored` where a pinhole's rows bend,
/// `row_offset` (median row difference above 0.5 px), `yaw_offset` (beyond 2.6 standard deviations; or negative
/// disparities that it explains), `focal_ratio` (above 0.3 %), `not_enough_texture` (fewer than 40 matches, or in fewer
/// than a quarter of the picture's parts). The rows tell a yaw by the pattern x y only, which the lens can imitate.
PairCheck check_pair(const Rig& rig, const StereoPair& pair, std::vector<PixelMatch> matches, ImageSize picture_size);

/// The same for pictures without a calibration, with guessed_rig(). No lens is given that the rows could be blamed on:
/// the yaw is always taken in.
PairCheck check_pictures(std::vector<PixelMatch> matches, ImageSize picture_size);

/// For pictures without a calibration: two equal pinholes side by side, 1 m apart, of 1.2 times the larger side as
/// focal length. What it says about rows, pitch and roll holds for any focal length near that.
Rig guessed_rig(ImageSize picture_size);

}  // namespace spartan
