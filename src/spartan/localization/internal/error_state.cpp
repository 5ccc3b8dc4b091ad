#include "spartan/localization/internal/error_state.h"

#include <cmath>

namespace spartan::internal {

NavigationState add_error(const NavigationState& s, const ErrorVector& e) {
  NavigationState r = s;
  r.world_from_body = s.world_from_body * exp_se3(e.segment<6>(error_at::kPose));
  r.velocity_m_s += e.segment<3>(error_at::kVelocity);
  r.gyro_bias_rad_s += e.segment<3>(error_at::kGyroBias);
  r.accel_bias_m_s2 += e.segment<3>(error_at::kAccelBias);
  r.gravity_tilt_rad += e.segment<2>(error_at::kGravityTilt);
  r.gravity_scale += e[error_at::kGravityScale];
  r.imu_time_offset_s += e[error_at::kImuTime];
  r.wheel_scale += e[error_at::kWheelScale];
  r.compass_offset_rad += e[error_at::kCompassOffset];
  r.inclinometer_bias_rad += e.segment<2>(error_at::kInclinometerBias);
  r.vision_drift += e.segment<6>(error_at::kVisionDrift);
  r.vision_constant += e.segment<6>(error_at::kVisionConstant);
  r.calibration += e.segment<8>(error_at::kCalibration);
  r.world_from_vision_clone = s.world_from_vision_clone * exp_se3(e.segment<6>(error_at::kVisionClone));
  r.world_from_step_clone = s.world_from_step_clone * exp_se3(e.segment<6>(error_at::kStepClone));
  return r;
}

ErrorVector error_between(const NavigationState& a, const NavigationState& b) {
  ErrorVector e;
  e.segment<6>(error_at::kPose) = log_se3(a.world_from_body.inverse() * b.world_from_body);
  e.segment<3>(error_at::kVelocity) = b.velocity_m_s - a.velocity_m_s;
  e.segment<3>(error_at::kGyroBias) = b.gyro_bias_rad_s - a.gyro_bias_rad_s;
  e.segment<3>(error_at::kAccelBias) = b.accel_bias_m_s2 - a.accel_bias_m_s2;
  e.segment<2>(error_at::kGravityTilt) = b.gravity_tilt_rad - a.gravity_tilt_rad;
  e[error_at::kGravityScale] = b.gravity_scale - a.gravity_scale;
  e[error_at::kImuTime] = b.imu_time_offset_s - a.imu_time_offset_s;
  e[error_at::kWheelScale] = b.wheel_scale - a.wheel_scale;
  e[error_at::kCompassOffset] = b.compass_offset_rad - a.compass_offset_rad;
  e.segment<2>(error_at::kInclinometerBias) = b.inclinometer_bias_rad - a.inclinometer_bias_rad;
  e.segment<6>(error_at::kVisionDrift) = b.vision_drift - a.vision_drift;
  e.segment<6>(error_at::kVisionConstant) = b.vision_constant - a.vision_constant;
  e.segment<8>(error_at::kCalibration) = b.calibration - a.calibration;
  e.segment<6>(error_at::kVisionClone) = log_se3(a.world_from_vision_clone.inverse() * b.world_from_vision_clone);
  e.segment<6>(error_at::kStepClone) = log_se3(a.world_from_step_clone.inverse() * b.world_from_step_clone);
  return e;
}

Eigen::Vector3d true_up(const Eigen::Vector2d& tilt) {
  return exp_so3({tilt.x(), tilt.y(), 0}) * Eigen::Vector3d::UnitZ();
}

// Exp(τ + δ) z = Exp(τ) Exp(J_r δ) z, so ∂/∂δ = −Exp(τ) [z]× J_r(τ).
Eigen::Matrix<double, 3, 2> true_up_jacobian(const Eigen::Vector2d& tilt) {
  const Eigen::Vector3d vector(tilt.x(), tilt.y(), 0);
  const Eigen::Matrix3d j =
      -exp_so3(vector).toRotationMatrix() * skew(Eigen::Vector3d::UnitZ()) * left_jacobian_so3(-vector);
  return j.leftCols<2>();
}

Eigen::Vector2d tilt_of_up(const Eigen::Vector3d& up) {
  const Eigen::Vector2d axis(-up.y(), up.x());  // z × up
  const double sine = axis.norm();
  if (sine < 1e-12) return Eigen::Vector2d::Zero();
  return axis * (std::atan2(sine, up.z()) / sine);
}

void clone_pose(StateEstimate& estimate, int index) {
  (index == error_at::kVisionClone ? estimate.state.world_from_vision_clone : estimate.state.world_from_step_clone) =
      estimate.state.world_from_body;
  ErrorCovariance& p = estimate.covariance;
  p.middleRows<6>(index) = p.middleRows<6>(error_at::kPose).eval();
  p.middleCols<6>(index) = p.middleCols<6>(error_at::kPose).eval();
  if (estimate.past) {
    ErrorCovariance& x = estimate.past->with_present;
    x.middleCols<6>(index) = x.middleCols<6>(error_at::kPose).eval();
  }
}

}  // namespace spartan::internal
