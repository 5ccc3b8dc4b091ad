// The point that the filter propagates: the IMU, with the axes of the body.
#pragma once

#include "spartan/core/pose.h"
#include "spartan/core/trajectory.h"
#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/localizer.h"

namespace spartan::internal {

/// The specific force of an IMU away from the body's origin depends on the angular acceleration, which is not measured.
/// So the state is that of a frame N at the IMU, parallel to the body's axes: T_N = T_B L with L = body_from_imu
/// without rotation. Right perturbations transform as ξ_N = Ad(L⁻¹) ξ_B.
class LeverArm {
 public:
  explicit LeverArm(const Eigen::Vector3d& imu_in_body)
      : body_from_imu_(Pose::from_translation(imu_in_body)), to_imu_(adjoint(body_from_imu_.inverse())) {}

  /// world_from_imu of a world_from_body, and back.
  Pose imu_pose(const Pose& body) const { return body * body_from_imu_; }
  Pose body_pose(const Pose& imu) const { return imu * body_from_imu_.inverse(); }
  UncertainPose body_pose(const UncertainPose& imu) const;

  /// The motion M of the body is L⁻¹ M L of the IMU.
  Pose imu_motion(const Pose& body) const { return body_from_imu_.inverse() * body * body_from_imu_; }
  /// Ad(L⁻¹), which transports perturbations of the body's motions and poses to the IMU.
  const Matrix6d& to_imu() const { return to_imu_; }

  PoseConstraint imu_constraint(const PoseConstraint& body) const;
  /// A point of the body, relative to the IMU.
  Eigen::Vector3d from_imu(const Eigen::Vector3d& point_in_body) const {
    return point_in_body - body_from_imu_.translation();
  }

 private:
  Pose body_from_imu_;
  Matrix6d to_imu_;
};

}  // namespace spartan::internal
