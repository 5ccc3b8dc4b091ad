// The absolute pose measurement that map merging gives to the localization.
#pragma once

#include "spartan/core/pose.h"
#include "spartan/core/time.h"

namespace spartan {

/// A measurement of world_from_body at a stamp, from a match with the map. Matrices refer to right perturbations, order
/// (translation, rotation), in m and rad.
struct PoseConstraint {
  Stamp stamp;
  Pose world_from_body;
  /// Information (inverse covariance) of the match with the map, m⁻² and rad⁻²: positive semidefinite, of any rank.
  /// Unobservable directions have zero information.
  Matrix6d information = Matrix6d::Zero();
  /// Covariance of the map around the rover as a rigid body, from the errors of the poses it was built with, m² and
  /// rad².
  Matrix6d map_covariance = Matrix6d::Zero();
};

/// Transports a constraint along a motion: the constraint of `constraint.world_from_body` · `motion` at `stamp`.
PoseConstraint transported(const PoseConstraint& constraint, const UncertainPose& motion, Stamp stamp);

/// Inflates information Λ by the covariance C of a further, independent error: (Λ⁻¹ + C)⁻¹, also for a singular Λ.
Matrix6d inflated(const Matrix6d& information, const Matrix6d& covariance);

/// The fraction S of the covariance P of a pose that it shares with a map built from earlier poses of the same drive:
/// the cross-covariance of both errors is P S. Along the common principal axes of both covariances (generalized
/// eigenvectors) the shared variance is the smaller one: where the pose has become less certain since, its error
/// contains the whole error of the map; where it has become more certain, the map's error contains that of the pose.
/// Both are covariances of the same right perturbation.
Matrix6d shared_fraction(const Matrix6d& pose, const Matrix6d& map);

}  // namespace spartan
