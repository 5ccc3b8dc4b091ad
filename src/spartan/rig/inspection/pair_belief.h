// What a calibration that does not fit its pictures may really mean.
#pragma once

#include <vector>

#include "spartan/rig/inspection/pair_refinement.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// A calibration of pictures of another size: focal lengths, and the centre too or not, times a factor.
struct SizeChange {
  bool left = false, right = false;  ///< the eyes it is of
  bool centre_too = false;
  double factor = 1;
  bool any() const { return left || right; }
};

/// A pair as it may really be: the calibration with its mistakes taken out.
struct PairBelief {
  Camera left, right;
  Pose left_from_right;
  bool inverted = false;            ///< the transform is the inverse of what it should be
  bool eyes_exchanged = false;      ///< what the rig calls left stands on the right
  bool lenses_exchanged = false;    ///< the eyes have each other's lenses
  bool pictures_exchanged = false;  ///< the picture given as the left one was taken by the right eye
  bool stated_size = false;         ///< put right where the calibration's own numbers look wrong (find_doubts)
  SizeChange size;                  ///< found by the pictures
  bool left_bends = false, right_bends = false;  ///< a pinhole that is none: its distortion is fitted too
};

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
  bool eyes_told = true;       ///< false: two equal eyes; an inverted transform and exchanged eyes are the same thing
  double rms_as_given_px = 0;  ///< what the calibration's own belief comes to, corrected
};

/// Tries the calibration as given (with sizes brought to those of the pictures where these are known); where rows or
/// signs disagree, the transform inverted, eyes, lenses or pictures exchanged, focal lengths of another picture size
/// for one eye or both, pinholes that bend. All are fitted to the same matches; the cheapest counts where it costs
/// clearly less than a simpler one. A belief with which the rows agree as they are is simpler than one that needs
/// corrections: those cost kCorrected a match. Disparities are positive: a belief that makes most of them negative is
/// out.
/// `calibrated`: false where the lenses are a guess, of which no size can be wrong.
BelievedPair believe_pair(const Camera& left, const Camera& right, const Pose& left_from_right,
                          const std::vector<PixelMatch>& matches, ImageSize picture, bool calibrated = true);

PairFitOptions fit_options(const PairBelief& belief);

}  // namespace spartan
