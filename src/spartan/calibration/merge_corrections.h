// Merging the corrections of several stereo pairs into one rig.
#pragma once

#include <string>
#include <vector>

#include "spartan/rig/rig.h"

namespace spartan {

/// The rig as corrected for one pair (PairCheck::corrected).
struct CorrectedPair {
  std::string pair;
  Rig rig;
};

struct MergedRig {
  Rig rig;
  std::vector<std::string> discarded;  ///< pairs whose correction contradicts that of an earlier pair
};

/// Applies the correction of every pair to the rig, in the given order. The images of a pair determine the pose of its
/// cameras relative to each other only. A camera shared by two pairs therefore keeps the pose that the first pair gave
/// it, and the other camera of the second pair moves instead. A correction is discarded where that is impossible: both
/// cameras belong to earlier pairs, or the shared camera's intrinsics would change again. All rigs have the cameras and
/// pairs of `given`.
MergedRig merge_corrections(const Rig& given, const std::vector<CorrectedPair>& pairs);

}  // namespace spartan
