// One rig of what was put right in each of its pairs.
#pragma once

#include <string>
#include <vector>

#include "spartan/rig/rig.h"

namespace spartan {

/// The rig as one pair's pictures want it (PairCheck::corrected).
struct CorrectedPair {
  std::string pair;
  Rig rig;
};

struct RigOfPairs {
  Rig rig;
  std::vector<std::string> left_out;  ///< pairs whose correction does not go with those before them
};

/// The rig with every pair's correction taken in, in that order. A camera of two pairs stays as the first of them has
/// it, and the other eye of the second one moves in its place: what a pair's pictures tell is how its eyes stand to
/// each other. Where that cannot be done (both eyes are of pairs before, or the camera's own numbers are to change
/// again) the pair is left out. All rigs have the cameras and pairs of `given`.
RigOfPairs take_together(const Rig& given, const std::vector<CorrectedPair>& pairs);

}  // namespace spartan
