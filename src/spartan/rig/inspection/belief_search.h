// Which meaning of a calibration its pictures agree with.
#pragma once

#include <vector>

#include "spartan/rig/inspection/pair_belief.h"
#include "spartan/rig/inspection/pair_refinement.h"

namespace spartan {

/// A belief fitted to the pictures.
struct BelievedPair {
  PairBelief belief;
  std::vector<PixelMatch> matches;  ///< exchanged where the pictures are
  PairFit fit;                      ///< of everything that the belief leaves open
  bool good_rows = false;           ///< without the corrections of the fit
  bool as_it_is = false;            ///< the rows agree as well without the corrections of the fit
  double cost = 0;                  ///< of the rows as they are, or corrected and then so much a match
  int lost = 0;                     ///< matches that cost as much as one can
  double wrong_side = 0;            ///< share of the inliers whose disparity is negative with at most a small yaw
  bool agrees = false;              ///< most rows do, on the right side
  /// They agree, and nothing about it is far-fetched. Where not, no mistake that is known here explains the
  /// pictures.
  bool explains = false;
  bool eyes_told = true;  ///< false: two equal eyes; an inverted transform and exchanged eyes are the same thing
  bool size_told = true;  ///< false: the other eye's size, the other way round, makes the rows agree as well
  /// Mean row difference of the inliers, px: with the calibration as given (the right eye on the right; NaN where it
  /// has no lines of sight), and with the belief, corrected where it is not `as_it_is`.
  double rows_given_px = 0, rows_px = 0;
};

/// Tries the calibration as given (with sizes brought to those of the pictures where these are known); where rows or
/// signs disagree, the transform inverted, eyes, lenses or pictures exchanged, focal lengths of another picture size
/// for one eye or both, pinholes that bend, and rows moved where no ordinary correction does. All are fitted to the
/// same matches; the cheapest counts where it costs clearly less than a simpler one. A belief with which the rows agree
/// as they are is simpler than one that needs corrections: those cost kCorrected a match. Disparities are positive: a
/// belief that makes most of them negative is out.
/// `calibrated`: false where the lenses are a guess, of which no size can be wrong.
BelievedPair believe_pair(const Camera& left, const Camera& right, const Pose& left_from_right,
                          const std::vector<PixelMatch>& matches, ImageSize picture, bool calibrated = true);

PairFitOptions fit_options(const PairBelief& belief);

}  // namespace spartan
