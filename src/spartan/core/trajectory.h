// Stamped poses: trajectories, and absolute pose measurements.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/time.h"

namespace spartan {

/// A pose with its time.
struct StampedPose {
  Stamp stamp;
  Pose pose;  ///< world_from_body
};

/// Poses with strictly increasing stamps.
using Trajectory = std::vector<StampedPose>;

enum class TrajectoryFormat { tum, kitti, euroc };

/// One line per pose: "seconds tx ty tz qx qy qz qw", seconds with nine decimals.
std::string to_tum(const Trajectory& trajectory);
/// One line per pose: the upper 3×4 part of the matrix in row-major order.
std::string to_kitti(const Trajectory& trajectory);
/// A header, then one line per pose: "timestamp [ns],px,py,pz,qw,qx,qy,qz".
std::string to_euroc(const Trajectory& trajectory);

/// The parsers return code `input` with "name:line" for a wrong number of values, values that are not finite numbers,
/// quaternions that do not have unit length (within 0.01), matrices that are not rotations (within 0.001 per element),
/// and stamps that do not increase.
Result<Trajectory> parse_tum(const std::string& text, const std::string& name);
/// `stamps`: one for each line, or empty for 0, 1, 2 … s.
Result<Trajectory> parse_kitti(const std::string& text, const std::string& name, const std::vector<Stamp>& stamps);
Result<Trajectory> parse_euroc(const std::string& text, const std::string& name);

/// A trajectory read from a file.
struct LoadedTrajectory {
  Trajectory poses;
  TrajectoryFormat format = TrajectoryFormat::tum;
  bool has_stamps = true;    ///< false: a KITTI file without `times.txt` beside it; the stamps are 0, 1, 2 … s
  bool has_rotation = true;  ///< false: all rotations are the identity, so the file holds positions only
};

/// Reads a trajectory and detects its format from the content: 12 numbers per line are KITTI (stamps from `times.txt`
/// beside it), commas are EuRoC, otherwise TUM. Code `input`.
Result<LoadedTrajectory> load_trajectory(const std::string& path);

/// Length of the polyline through the positions, m.
double path_length(const Trajectory& trajectory);

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
