// What map merging tells the localization: where the rover was, as far as the map could decide.
#pragma once

#include "spartan/core/pose.h"
#include "spartan/core/time.h"

namespace spartan {

/// world_from_body at a stamp, as the map has it. Perturbations stand on the right, order (translation, rotation).
struct PoseConstraint {
  Stamp stamp;
  Pose world_from_body;
  /// Inverse covariance of the match with the map, m⁻² and rad⁻². Directions that nothing is known about have no
  /// information: the matrix is positive semidefinite and may be of any rank.
  Matrix6d information = Matrix6d::Zero();
  /// Of the map under the rover, as rigidly fixed to it: errors of the poses that it was made from.
  Matrix6d map_covariance = Matrix6d::Zero();
};

/// The same of the pose that a motion led to: `constraint.world_from_body` · `motion`, at `stamp`.
PoseConstraint carried(const PoseConstraint& constraint, const UncertainPose& motion, Stamp stamp);

/// Information of a measurement whose error gets one more, independent part.
Matrix6d blurred(const Matrix6d& information, const Matrix6d& covariance);

/// What the errors of a pose and of a map made from earlier poses of the same drive have in common, as the share S of
/// the pose's covariance P: their cross-covariance is P S. Where the pose has become less certain since, it has all of
/// the map's error; where it has become more certain, the map has all of the pose's: along common axes of both the
/// smaller variance. Covariances of the same right perturbation.
Matrix6d common_share(const Matrix6d& pose, const Matrix6d& map);

}  // namespace spartan
