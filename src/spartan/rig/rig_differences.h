// Comparison of two rigs, for reports of what a conversion loses.
#pragma once

#include <string>
#include <vector>

#include "spartan/rig/rig.h"

namespace spartan {

struct RigDifference {
  std::string key;   ///< as in rig.yaml: "cameras.left.distortion"; "body" for the body frame
  std::string text;  ///< what was, and what it is now
};

/// Where the resulting rig differs from the wanted one, in the order of rig.yaml, then what only the resulting one has.
/// Cameras are matched by their role in the pairs, then by name. Camera models are equal if they project equally
/// (model_equivalents.h), numbers if they agree to 12 digits, poses if they agree to 1e-11 m and rad, which is the
/// rounding of a conversion between representations of a rotation.
std::vector<RigDifference> describe_differences(const Rig& wanted, const Rig& result);

}  // namespace spartan
