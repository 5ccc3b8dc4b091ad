// Relative motion of the body between two frames, as measured by visual odometry.
#pragma once

#include "spartan/core/pose.h"
#include "spartan/core/time.h"

namespace spartan {

struct RelativeMotion {
  Stamp from, to;                          ///< of the two frames
  Pose previous_from_current;              ///< body frames; the exact identity means a stationary rover
  Matrix6d covariance = Matrix6d::Zero();  ///< of the right perturbation, (translation, rotation), m² rad²
  bool measured = true;                    ///< false: tracking was lost, the motion is not used
};

}  // namespace spartan
