// Inertial motion over an interval, independent of where the body is, how fast it moves and where gravity points.
#pragma once

#include <Eigen/Core>

#include "spartan/localization/internal/propagation.h"

namespace spartan::internal {

/// Rotation ΔR, velocity Δv and position Δp that the IMU measures from the begin of an interval on, in the body frame
/// at its begin, without gravity and the velocity at its begin:
///
///     R' = R ΔR,   v' = v − g up t + R Δv,   p' = p + v t − ½ g up t² + R Δp.
///
/// Integrated with nominal biases; derivatives by the biases correct them to first order. Source: Lupton & Sukkarieh,
/// "Visual-inertial-aided navigation for high-dynamic motion in built environments without initial conditions", TRO
/// 2012; Forster et al., "On-manifold preintegration for real-time visual-inertial odometry", TRO 2017. The mid-point
/// rule of propagation.h is used.
struct Preintegration {
  double seconds = 0;
  Eigen::Vector3d gyro_bias_rad_s = Eigen::Vector3d::Zero(), accel_bias_m_s2 = Eigen::Vector3d::Zero();  ///< nominal
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero(), position = Eigen::Vector3d::Zero();
  /// Derivatives: rotation as ΔR Exp(J δb).
  Eigen::Matrix3d rotation_by_gyro = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d velocity_by_gyro = Eigen::Matrix3d::Zero(), velocity_by_accel = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d position_by_gyro = Eigen::Matrix3d::Zero(), position_by_accel = Eigen::Matrix3d::Zero();
  /// Of (rotation, velocity, position) by the time at which the readings are taken: how much each changes if all
  /// readings are those of 1 s later.
  Eigen::Matrix<double, 9, 1> by_time = Eigen::Matrix<double, 9, 1>::Zero();
  /// Of (rotation, velocity, position), by white noise.
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();

  void add(const InertialStep& step, const InertialNoise& noise);
};

}  // namespace spartan::internal
