// What visual odometry tells the localization: how the body moved between two shots.
#pragma once

#include "spartan/core/pose.h"
#include "spartan/core/time.h"

namespace spartan {

struct RelativeMotion {
  Stamp from, to;                          ///< of the two shots
  Pose previous_from_current;              ///< body frames; the exact identity says that the rover stood
  Matrix6d covariance = Matrix6d::Zero();  ///< of the right perturbation, (translation, rotation), m² rad²
  bool measured = true;                    ///< false: vision was lost, the motion is worth nothing
};

}  // namespace spartan
