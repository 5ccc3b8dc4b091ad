#include "spartan/localization/internal/measurement_models.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace spartan::internal {
namespace {

const Pose& clone_of(const NavigationState& s, int clone) {
  return clone == error_at::kVisionClone ? s.world_from_vision_clone : s.world_from_step_clone;
}

const Pose& pose_of(const NavigationState& s, int pose) {
  return pose == error_at::kPose ? s.world_from_body : clone_of(s, pose);
}

// The displacement of the step along its mean attitude, and the derivative with respect to the right perturbation of
// the motion:
//   t' = t + ΔR ρ,  φ' = φ + J_r⁻¹(φ) φ_e,  t_mid = Exp(−φ/2) t
//   ∂t_mid = Exp(φ/2) ρ_e + ½ [t_mid]× J_l(−φ/2) J_r⁻¹(φ) φ_e        (Exp(−φ/2) ΔR = Exp(φ/2))
struct MeanStep {
  Eigen::Vector3d displacement, rotation;
  Eigen::Matrix<double, 3, 6> displacement_by, rotation_by;
};

MeanStep mean_step(const Pose& motion) {
  MeanStep m;
  m.rotation = log_so3(motion.rotation());
  const Eigen::Vector3d half = 0.5 * m.rotation;
  m.displacement = exp_so3(-half) * motion.translation();
  const Eigen::Matrix3d rotation_by = left_jacobian_inverse_so3(-m.rotation);
  m.displacement_by << exp_so3(half).toRotationMatrix(),
      0.5 * skew(m.displacement) * left_jacobian_so3(-half) * rotation_by;
  m.rotation_by << Eigen::Matrix3d::Zero(), rotation_by;
  return m;
}

}  // namespace

MotionSinceClone motion_since_clone(const NavigationState& s, int clone) {
  MotionSinceClone m;
  m.clone_from_body = clone_of(s, clone).inverse() * s.world_from_body;
  m.jacobian.setZero();
  m.jacobian.middleCols<6>(error_at::kPose).setIdentity();
  m.jacobian.middleCols<6>(clone) = -adjoint(m.clone_from_body.inverse());
  return m;
}

Vector6d lasting_error(const NavigationState& s, const MotionErrors& errors) {
  return errors.drift * (s.vision_drift + s.vision_constant) + errors.by_calibration * s.calibration;
}

Innovation relative_motion_innovation(const NavigationState& s, int clone, const Pose& measured,
                                      const Matrix6d& covariance, const MotionErrors& errors) {
  const MotionSinceClone m = motion_since_clone(s, clone);
  Innovation i(6);
  const Vector6d lasting = lasting_error(s, errors);
  const Vector6d r = log_se3(m.clone_from_body.inverse() * measured * exp_se3(lasting));
  const Matrix6d right = right_jacobian_inverse_se3(r) * right_jacobian_se3(lasting),
                 left = right_jacobian_inverse_se3(-r);
  i.residual = r;
  i.jacobian = m.jacobian;
  i.jacobian.middleCols<6>(clone) = left * m.jacobian.middleCols<6>(clone);
  i.jacobian.middleCols<6>(error_at::kPose) = left;
  i.jacobian.middleCols<6>(error_at::kVisionDrift) = -right * errors.drift;
  i.jacobian.middleCols<6>(error_at::kVisionConstant) = i.jacobian.middleCols<6>(error_at::kVisionDrift);
  i.jacobian.middleCols<8>(error_at::kCalibration) = -right * errors.by_calibration;
  i.noise = right * covariance * right.transpose();
  return i;
}

// The motion W = K⁻¹ M K of the turning centre, K = translation by `centre`: its right perturbation is Ad(K⁻¹) ξ.
MotionSinceClone motion_of_centre(const NavigationState& s, int clone, const Eigen::Vector3d& centre) {
  MotionSinceClone m = motion_since_clone(s, clone);
  if (centre.isZero(0)) return m;
  const Pose to_centre = Pose::from_translation(centre);
  m.clone_from_body = to_centre.inverse() * m.clone_from_body * to_centre;
  m.jacobian = (adjoint(to_centre.inverse()) * m.jacobian).eval();
  return m;
}

Innovation wheel_innovation(const NavigationState& s, const WheelStep& step, const Eigen::Vector3d& centre) {
  const MotionSinceClone m = motion_of_centre(s, error_at::kStepClone, centre);
  const MeanStep mean = mean_step(m.clone_from_body);
  Innovation i(step.yaw_known ? 4 : 3);
  i.residual.head<3>() = Eigen::Vector3d(s.wheel_scale * step.counted_m, 0, 0) - mean.displacement;
  i.jacobian.topRows<3>() = mean.displacement_by * m.jacobian;
  i.jacobian(0, error_at::kWheelScale) = -step.counted_m;
  i.noise.diagonal().head<3>() << step.forward_sigma_m * step.forward_sigma_m, step.side_sigma_m * step.side_sigma_m,
      step.up_sigma_m * step.up_sigma_m;
  if (step.yaw_known) {
    i.residual[3] = step.yaw_rad - mean.rotation.z();
    i.jacobian.row(3) = mean.rotation_by.row(2) * m.jacobian;
    i.noise(3, 3) = step.yaw_sigma_rad * step.yaw_sigma_rad;
  }
  return i;
}

double forward_of(const Pose& motion) {
  return mean_step(motion).displacement.x();
}

StepForward forward_since(const NavigationState& s, int clone, const Eigen::Vector3d& centre) {
  const MotionSinceClone m = motion_of_centre(s, clone, centre);
  const MeanStep mean = mean_step(m.clone_from_body);
  return {mean.displacement.x(), mean.displacement_by.row(0) * m.jacobian};
}

double heading_of(const Pose& world_from_body) {
  const Eigen::Vector3d ahead = world_from_body.rotation() * Eigen::Vector3d::UnitX();
  return std::atan2(ahead.y(), ahead.x());
}

double heading_about_up(const NavigationState& s) {
  const Eigen::Vector3d tilt(s.gravity_tilt_rad.x(), s.gravity_tilt_rad.y(), 0);
  return heading_of(Pose::from_rotation(exp_so3(-tilt) * s.world_from_body.rotation()));
}

// With v = R x̂, a = Exp(−τ) v: δa = Exp(−τ) (−R [x̂]× φ + [v]× J_l(τ) δτ), δψ = (a_x δa_y − a_y δa_x) / (a_x² + a_y²).
Innovation compass_innovation(const NavigationState& s, double heading_rad, double sigma_rad) {
  const Eigen::Matrix3d r = s.world_from_body.rotation_matrix();
  const Eigen::Vector3d tilt(s.gravity_tilt_rad.x(), s.gravity_tilt_rad.y(), 0);
  const Eigen::Matrix3d level = exp_so3(-tilt).toRotationMatrix();
  const Eigen::Vector3d ahead = level * r.col(0);
  const Eigen::RowVector3d by_ahead =
      Eigen::RowVector3d(-ahead.y(), ahead.x(), 0) / std::max(ahead.head<2>().squaredNorm(), 1e-6);
  const Eigen::Matrix3d by_tilt = level * skew(r.col(0)) * left_jacobian_so3(tilt);
  Innovation i(1);
  i.residual[0] = std::remainder(heading_rad - heading_about_up(s) - s.compass_offset_rad, 2 * std::numbers::pi);
  i.jacobian.block<1, 3>(0, error_at::kAttitude) = -by_ahead * level * r * skew(Eigen::Vector3d::UnitX());
  i.jacobian.block<1, 2>(0, error_at::kGravityTilt) = by_ahead * by_tilt.leftCols<2>();
  i.jacobian(0, error_at::kCompassOffset) = 1;
  i.noise(0, 0) = sigma_rad * sigma_rad;
  return i;
}

Eigen::Vector2d roll_pitch_of_up(const Eigen::Vector3d& up) {
  return {std::atan2(up.y(), up.z()), std::atan2(-up.x(), std::hypot(up.y(), up.z()))};
}

Eigen::Vector3d up_of_roll_pitch(double roll, double pitch) {
  return {-std::sin(pitch), std::sin(roll) * std::cos(pitch), std::cos(roll) * std::cos(pitch)};
}

// With u = R̂ᵀ up: δu = [u]× φ + Rᵀ ∂up δτ; roll = atan2(u_y, u_z), pitch = atan2(−u_x, |u_yz|).
Innovation inclinometer_innovation(const NavigationState& s, double roll, double pitch, double sigma) {
  const Eigen::Matrix3d to_body = s.world_from_body.rotation().conjugate().toRotationMatrix();
  const Eigen::Vector3d u = to_body * true_up(s.gravity_tilt_rad);
  const double side = std::max(std::hypot(u.y(), u.z()), 1e-3);
  Eigen::Matrix<double, 2, 3> by_up;
  by_up << 0, u.z() / (side * side), -u.y() / (side * side),  //
      -side, u.x() * u.y() / side, u.x() * u.z() / side;
  Innovation i(2);
  i.residual = Eigen::Vector2d(roll, pitch) - roll_pitch_of_up(u) - s.inclinometer_bias_rad;
  for (Eigen::Index k = 0; k < 2; ++k) i.residual[k] = std::remainder(i.residual[k], 2 * std::numbers::pi);
  i.jacobian.middleCols<3>(error_at::kAttitude) = by_up * skew(u);
  i.jacobian.middleCols<2>(error_at::kGravityTilt) = by_up * to_body * true_up_jacobian(s.gravity_tilt_rad);
  i.jacobian.middleCols<2>(error_at::kInclinometerBias).setIdentity();
  i.noise.diagonal().setConstant(sigma * sigma);
  return i;
}

// u = R̂ᵀ up: δu = [u]× φ + Rᵀ ∂up δτ.
UpInBody up_in_body(const NavigationState& s, int pose) {
  const Eigen::Matrix3d to_body = pose_of(s, pose).rotation().conjugate().toRotationMatrix();
  UpInBody u;
  u.up = to_body * true_up(s.gravity_tilt_rad);
  u.jacobian.setZero();
  u.jacobian.middleCols<3>(pose + 3) = skew(u.up);
  u.jacobian.middleCols<2>(error_at::kGravityTilt) = to_body * true_up_jacobian(s.gravity_tilt_rad);
  return u;
}

Innovation rest_innovation(const NavigationState& s, const Eigen::Vector3d& mean_accel, double sigma, double gravity) {
  const Eigen::Matrix3d to_body = s.world_from_body.rotation().conjugate().toRotationMatrix();
  const Eigen::Vector3d unit = gravity * (to_body * true_up(s.gravity_tilt_rad)), expected = s.gravity_scale * unit;
  Innovation i(3);
  i.residual = mean_accel - expected - s.accel_bias_m_s2;
  i.jacobian.middleCols<3>(error_at::kAttitude) = skew(expected);
  i.jacobian.middleCols<2>(error_at::kGravityTilt) =
      s.gravity_scale * gravity * to_body * true_up_jacobian(s.gravity_tilt_rad);
  i.jacobian.col(error_at::kGravityScale) = unit;
  i.jacobian.middleCols<3>(error_at::kAccelBias).setIdentity();
  i.noise.diagonal().setConstant(sigma * sigma);
  return i;
}

// T = X̂ Exp(ξ) Exp(n): Log(X̂⁻¹ T) = ξ + J_r⁻¹(r) n. Information Λ of n becomes J_rᵀ Λ J_r; its eigenvectors with any
// information are independent scalar measurements.
Innovation map_innovation(const StateEstimate& estimate, int pose, const PoseConstraint& constraint,
                          double covariance_factor) {
  // Directions with less information, absolutely (1/m², 1/rad²) or relative to the largest, are not measured.
  constexpr double kMinInformation = 1e-6, kMinInformationRatio = 1e-12;
  const Vector6d r = log_se3(pose_of(estimate.state, pose).inverse() * constraint.world_from_body);
  const Matrix6d jacobian = right_jacobian_se3(r);
  const Matrix6d turned = jacobian.transpose() * constraint.information * jacobian;
  const SymmetricEigen eigen = eigen_of_symmetric(0.5 * (turned + turned.transpose()));
  const Vector6d values = eigen.values / covariance_factor;
  const double least = std::max(kMinInformation, kMinInformationRatio * values[5]);
  int first = 0;
  while (first < 6 && !(values[first] > least)) ++first;
  const int rows = 6 - first;
  Innovation i(rows);
  if (rows == 0) return i;
  const auto directions = eigen.vectors.rightCols(rows).transpose();
  i.residual = directions * r;
  i.jacobian.middleCols<6>(pose) = directions;
  i.noise.diagonal() = values.tail(rows).cwiseInverse();

  const Matrix6d inverse = inverse_of(jacobian);
  const Matrix6d map = inverse * constraint.map_covariance * inverse.transpose();
  i.noise += directions * map * directions.transpose();
  const Matrix6d pose_covariance = estimate.covariance.block<6, 6>(pose, pose);
  // The residual is truth minus estimate plus the error of the map: an error that both share cancels, hence the sign.
  i.shared = -estimate.covariance.middleCols<6>(pose) * shared_fraction(pose_covariance, map) * directions.transpose();
  return i;
}

}  // namespace spartan::internal
