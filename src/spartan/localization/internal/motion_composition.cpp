#include "spartan/localization/internal/motion_composition.h"

namespace spartan::internal {

void compose_motion(StateEstimate& estimate, const Pose& measured, const Matrix6d& covariance,
                    const MotionErrors& errors) {
  NavigationState& s = estimate.state;
  ErrorCovariance& p = estimate.covariance;
  const Vector6d lasting = lasting_error(s, errors);
  const Pose motion = measured * exp_se3(lasting);
  s.world_from_body = s.world_from_vision_clone * motion;

  const Matrix6d right = right_jacobian_se3(lasting);
  Eigen::Matrix<double, 6, error_at::kSize> by = Eigen::Matrix<double, 6, error_at::kSize>::Zero();
  by.middleCols<6>(error_at::kVisionClone) = adjoint(motion.inverse());
  by.middleCols<6>(error_at::kVisionDrift) = right * errors.drift;
  by.middleCols<6>(error_at::kVisionConstant) = by.middleCols<6>(error_at::kVisionDrift);
  by.middleCols<8>(error_at::kCalibration) = right * errors.by_calibration;
  Eigen::Matrix<double, 6, error_at::kSize> rows = by * p;
  const Matrix6d own = rows * by.transpose() + right * covariance * right.transpose();
  rows.middleCols<6>(error_at::kPose) = 0.5 * (own + own.transpose());
  p.middleRows<6>(error_at::kPose) = rows;
  p.middleCols<6>(error_at::kPose) = rows.transpose();
  if (estimate.past) {
    ErrorCovariance& x = estimate.past->with_present;
    x.middleCols<6>(error_at::kPose) = (x * by.transpose()).eval();
  }
}

// p' = p + ½ (R + R') w t, and to second order in the rotation vector φ of the motion: ½ (I + Exp φ) = Exp(½ φ).
void set_velocity(StateEstimate& estimate, const Pose& motion, double seconds, double variance) {
  const Eigen::Vector3d half = 0.5 * log_so3(motion.rotation());
  estimate.state.velocity_m_s = exp_so3(-half) * motion.translation() / seconds;
  ErrorCovariance& p = estimate.covariance;
  p.middleRows<3>(error_at::kVelocity).setZero();
  p.middleCols<3>(error_at::kVelocity).setZero();
  p.diagonal().segment<3>(error_at::kVelocity).setConstant(variance);
  if (estimate.past) estimate.past->with_present.middleCols<3>(error_at::kVelocity).setZero();
}

}  // namespace spartan::internal
