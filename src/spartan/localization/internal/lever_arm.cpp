#include "spartan/localization/internal/lever_arm.h"

namespace spartan::internal {

UncertainPose LeverArm::body_pose(const UncertainPose& imu) const {
  const Matrix6d to_body = adjoint(body_from_imu_);
  return {body_pose(imu.pose), to_body * imu.covariance * to_body.transpose()};
}

// n_B = Ad(L) n_N, so the information of n_N is Ad(L)ᵀ Λ Ad(L).
PoseConstraint LeverArm::imu_constraint(const PoseConstraint& body) const {
  const Matrix6d to_body = adjoint(body_from_imu_);
  PoseConstraint imu = body;
  imu.world_from_body = imu_pose(body.world_from_body);
  imu.information = to_body.transpose() * body.information * to_body;
  imu.map_covariance = to_imu_ * body.map_covariance * to_imu_.transpose();
  return imu;
}

}  // namespace spartan::internal
