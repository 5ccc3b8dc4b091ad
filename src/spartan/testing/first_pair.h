// Geometry of a rig's first pair.
#pragma once

#include "spartan/rig/rig.h"

namespace spartan::testing {

/// Position of the right camera in the frame of the left one, in metres.
inline Eigen::Vector3d right_in_left(const Rig& rig) {
  return rig.right_from_left(rig.pairs[0]).inverse().translation();
}

}  // namespace spartan::testing
