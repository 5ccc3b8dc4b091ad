// Where the eyes of a rig's first pair stand.
#pragma once

#include "spartan/rig/rig.h"

namespace spartan::testing {

/// The right eye in the left one's frame, metres.
inline Eigen::Vector3d right_in_left(const Rig& rig) {
  return rig.right_from_left(rig.pairs[0]).inverse().translation();
}

}  // namespace spartan::testing
