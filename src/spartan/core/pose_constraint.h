// What map merging tells the localization: where the rover was, as far as the map could decide.
#pragma once

#include "spartan/core/pose.h"
#include "spartan/core/time.h"

namespace spartan {

/// world_from_body at a stamp, with the information (inverse covariance) of its right perturbation, order
/// (translation, rotation), m⁻² and rad⁻². Directions that nothing is known about have no information: the matrix is
/// positive semidefinite and may be of any rank.
struct PoseConstraint {
  Stamp stamp;
  Pose world_from_body;
  Matrix6d information = Matrix6d::Zero();
};

}  // namespace spartan
