// What became of a rig.
#pragma once

#include <string>
#include <vector>

#include "spartan/rig/rig.h"

namespace spartan {

struct RigDifference {
  std::string key;   ///< as in rig.yaml: "cameras.left.distortion"; "body" for the body's frame
  std::string text;  ///< a sentence
};

/// What of the wanted rig is another way in the one that was got, in the order of rig.yaml, then what is in that one
/// only. Cameras belong together by
/// their places in the pairs, then by name. Models that see the same are the same (model_equivalents.h); numbers are
/// when they agree to 12 digits, poses to 1e-11 m and rad: what rotations in other forms round.
std::vector<RigDifference> describe_differences(const Rig& wanted, const Rig& got);

}  // namespace spartan
