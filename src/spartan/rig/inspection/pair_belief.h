// What a calibration that does not fit its pictures may really mean, one mistake at a time.
#pragma once

#include <vector>

#include "spartan/rig/inspection/pair_refinement.h"
#include "spartan/rig/rig.h"
#include "spartan/rig/rig_findings.h"

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
  double rows_lower_px = 0;         ///< the right picture shows everything so much lower than the calibration says
  bool left_bends = false, right_bends = false;  ///< a pinhole that is none: its distortion is fitted too
};

/// The calibration as given, each eye's brought to this size of the pictures where it is of another one of the same
/// shape. An empty size is not known.
PairBelief belief_as_given(const Camera& left, const Camera& right, const Pose& left_from_right, ImageSize picture);

/// With the right eye on the right: the inverse of the transform as given where it is not.
PairBelief with_eyes_in_place(PairBelief belief);

/// The eyes have each other's places. Where the transform has the right one on the left, that is another way to read
/// it; where it does not, only the lenses can be exchanged.
PairBelief with_other_eyes(PairBelief belief);

PairBelief with_other_pictures(PairBelief belief);

/// The matches as the belief has their pictures.
std::vector<PixelMatch> as_believed(const PairBelief& belief, const std::vector<PixelMatch>& matches);

/// A crop that nobody told the calibration of: the right eye's centre moved until the median row agrees, over what was
/// moved before. A lens that bends does so about its centre, which no pitch can imitate. `matches` as given.
PairBelief with_rows_moved(PairBelief belief, const std::vector<PixelMatch>& matches);

/// The same with the rows where the calibration has them.
PairBelief with_rows_as_given(PairBelief belief);

/// With another size; rows that were moved are moved anew. `matches` as given.
PairBelief with_size(PairBelief belief, const SizeChange& size, const std::vector<PixelMatch>& matches);

/// With square pixels where fx and fy are apart: by fx, and by fy.
std::vector<PairBelief> with_square_eyes(const PairBelief& belief, AspectDoubt least);

}  // namespace spartan
