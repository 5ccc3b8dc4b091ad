// Judging the calibration of a stereo pair by pictures that it took.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "spartan/rig/inspection/pair_refinement.h"
#include "spartan/rig/inspection/row_errors.h"
#include "spartan/rig/rig.h"
#include "spartan/rig/rig_findings.h"

namespace spartan {

enum class PairVerdict {
  good,    ///< rows agree to 0.5 px in the mean and 1.5 px for 95 %, and nothing is found
  usable,  ///< to 1 px and 3 px: stereo works and loses some; or nothing worse is found than a doubt
  bad,     ///< what is found spoils the ranges or the rows; or the pictures show too little to judge
};
std::string_view name_of(PairVerdict verdict);

struct PairCheck {
  int matches = 0, inliers = 0;  ///< inliers fit the corrected pair
  /// Of the inliers: rows in the pictures as taken; in the rectified view of the pair as given (but for eyes, transform
  /// and picture size that were found wrong: with those no row means anything); of the rig `corrected`. NaN where there
  /// is too little to tell.
  RowErrors as_taken, as_given, as_corrected;
  std::vector<RowErrorCell> map;     ///< 8 x 6 cells over the left picture, those with at least 3 matches
  PairCorrection correction, sigma;  ///< sigma of yaw: with what a lens can do that looks like it (0.3°); NaN as above
  double yaw_doubt_px = 0;  ///< what the sigma of the yaw is worth in disparity: rows leave range that uncertain
  std::vector<RigFinding> findings;
  PairVerdict verdict = PairVerdict::bad;
  std::vector<PixelMatch> matched;   ///< the inliers, for pictures
  std::vector<double> row_error_px;  ///< of them, as given
  double inlier_limit_px = 0;        ///< row error of the corrected pair up to which a match is one
  bool pictures_exchanged = false;   ///< the first picture is the right eye's: `matched` and `corrected` have it so
  bool structure_found = false;      ///< eyes, transform or size are wrong: the rig as given cannot be drawn
  /// The rig with what was found taken in: eyes, transform, unit, sizes, distortion; turns, and yaw, focal ratio and
  /// the baseline's direction where the pictures need them. Nothing found: the rig as given. Nothing explains the
  /// pictures: none.
  std::optional<Rig> corrected;
};

/// `matches`: of one or more shots; a share of them may be wrong. `picture_size`: of the pictures they come from.
/// Beside the findings of find_doubts() as far as the pictures leave them:
/// - `inverse_transform`, `swapped_eyes`, `size_mismatch`, `distortion_ignored`: what believe_pair() finds;
/// - `row_offset`: median row difference above 0.5 px; `roll_offset`: rows turned by more than 0.5 px over half the
///   picture's width; `rows_apart`: rows differ by more than a good pair's and nothing else was found;
/// - `yaw_offset`: beyond 2.6 standard deviations, or negative disparities that it explains. The rows tell a yaw by the
///   pattern x y only, which the lens can imitate;
/// - `focal_ratio`: above 0.3 %;
/// - `not_enough_texture`: fewer than 40 matches agree, or in fewer than a quarter of the picture's parts;
/// - `same_picture`: both pictures are one; `not_explained`: no mistake that is known here makes the rows agree: other
///   moments, other places, another rig.
PairCheck check_pair(const Rig& rig, const StereoPair& pair, const std::vector<PixelMatch>& matches,
                     ImageSize picture_size);

/// The same for pictures without a calibration, with guessed_rig(). Yaw, focal ratio and distortion are those of a
/// guess: they are taken in, but not findings.
PairCheck check_pictures(const std::vector<PixelMatch>& matches, ImageSize picture_size);

/// For pictures without a calibration: two equal pinholes side by side, 1 m apart, of 1.2 times the larger side as
/// focal length. What it says about rows, pitch and roll holds for any focal length near that.
Rig guessed_rig(ImageSize picture_size);

}  // namespace spartan
