#include "spartan/localization/internal/preintegration.h"

#include "spartan/core/pose.h"

namespace spartan::internal {

// With θ = (½ (ω₀ + ω₁) − b_g) t, ΔR' = ΔR Exp(θ) and a = ½ (ΔR f₀ + ΔR' f₁):
//   φ' = Exp(θ)ᵀ φ − J_r(θ) t δb_g
//   δa = −½ (ΔR [f₀]× φ + ΔR' [f₁]× φ') − ½ (ΔR + ΔR') δb_a
//   δv' = δv + t δa,   δp' = δp + t δv + ½ t² δa
// Readings later by ε are those with the biases −ε (ω₁ − ω₀)/t and −ε (f₁ − f₀)/t.
void Preintegration::add(const InertialStep& step, const InertialNoise& noise) {
  const double t = step.seconds;
  const Eigen::Vector3d angle = (0.5 * (step.gyro_from + step.gyro_to) - gyro_bias_rad_s) * t;
  const Eigen::Matrix3d turn = exp_so3(angle).toRotationMatrix(), before = rotation, after = before * turn;
  const Eigen::Matrix3d right_jacobian = left_jacobian_so3(-angle);
  const Eigen::Vector3d from = step.accel_from - accel_bias_m_s2, to = step.accel_to - accel_bias_m_s2;
  const Eigen::Vector3d accel = 0.5 * (before * from + after * to);
  const Eigen::Matrix3d accel_by_before = -0.5 * before * skew(from), accel_by_after = -0.5 * after * skew(to);
  const Eigen::Matrix3d accel_by_accel = -0.5 * (before + after);

  const Eigen::Matrix3d rotation_after = turn.transpose() * rotation_by_gyro - right_jacobian * t;
  const Eigen::Matrix3d accel_by_gyro = accel_by_before * rotation_by_gyro + accel_by_after * rotation_after;
  position += t * velocity + 0.5 * t * t * accel;
  const Eigen::Vector3d gyro_by_time = (step.gyro_to - step.gyro_from) / -t,
                        accel_change = (step.accel_to - step.accel_from) / -t;
  const Eigen::Vector3d rotation_by_time = by_time.head<3>();
  const Eigen::Vector3d rotation_by_time_after =
      turn.transpose() * rotation_by_time - right_jacobian * t * gyro_by_time;
  const Eigen::Vector3d accel_by_time =
      accel_by_before * rotation_by_time + accel_by_after * rotation_by_time_after + accel_by_accel * accel_change;
  by_time.tail<3>() += t * by_time.segment<3>(3) + 0.5 * t * t * accel_by_time;
  by_time.segment<3>(3) += t * accel_by_time;
  by_time.head<3>() = rotation_by_time_after;

  position_by_gyro += t * velocity_by_gyro + 0.5 * t * t * accel_by_gyro;
  position_by_accel += t * velocity_by_accel + 0.5 * t * t * accel_by_accel;
  velocity += t * accel;
  velocity_by_gyro += t * accel_by_gyro;
  velocity_by_accel += t * accel_by_accel;
  rotation_by_gyro = rotation_after;
  rotation = after;
  seconds += t;

  const Eigen::Matrix3d accel_by_rotation = accel_by_before + accel_by_after * turn.transpose();
  Eigen::Matrix<double, 9, 9> transition = Eigen::Matrix<double, 9, 9>::Identity();
  transition.block<3, 3>(0, 0) = turn.transpose();
  transition.block<3, 3>(3, 0) = t * accel_by_rotation;
  transition.block<3, 3>(6, 0) = 0.5 * t * t * accel_by_rotation;
  transition.block<3, 3>(6, 3) = t * Eigen::Matrix3d::Identity();
  covariance = (transition * covariance * transition.transpose()).eval();
  const Eigen::Matrix3d force = t * after * noise.accel.cwiseAbs2().asDiagonal() * after.transpose();
  covariance.diagonal().head<3>() += t * noise.gyro.cwiseAbs2();
  covariance.block<3, 3>(3, 3) += force;
  covariance.block<3, 3>(6, 6) += t * t / 3 * force;
  covariance.block<3, 3>(3, 6) += t / 2 * force;
  covariance.block<3, 3>(6, 3) += t / 2 * force;
}

}  // namespace spartan::internal
