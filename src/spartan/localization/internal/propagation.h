// Propagation of state and covariance: inertial, or with constant velocity.
#pragma once

#include <Eigen/Core>

#include "spartan/localization/internal/error_state.h"

namespace spartan::internal {

/// IMU readings at both ends of a step.
struct InertialStep {
  Eigen::Vector3d gyro_from, gyro_to;    ///< rad/s
  Eigen::Vector3d accel_from, accel_to;  ///< specific force, m/s²
  double seconds = 0;
};

/// Densities of white noise, for each axis of the body, and of random walks.
struct InertialNoise {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero(), accel = Eigen::Vector3d::Zero();
  double gyro_walk = 0, accel_walk = 0;
};

/// Constant-velocity model: velocity and angular rate are constant in the body frame, but for noise.
struct ConstantVelocityStep {
  Eigen::Vector3d rate_rad_s;
  double seconds = 0;
};
struct ConstantVelocityNoise {
  double velocity_m_s_sqrt_hz = 0, attitude_rad_sqrt_hz = 0;
};

/// The propagated part of the error after a step: by_moving · moving part + by_constants · (gravity tilt, gravity
/// scale, clock of the IMU) + noise of covariance `noise`.
struct Transition {
  Eigen::Matrix<double, error_at::kMoving, error_at::kMoving> by_moving;
  Eigen::Matrix<double, error_at::kMoving, 4> by_constants;
  Eigen::Matrix<double, error_at::kMoving, error_at::kMoving> noise;
};

/// Mid-point integration: rotation by the mean rate, acceleration by the mean of both specific forces, each rotated
/// into the world. p' = p + v t + ½ a t², v' = v + a t in the world, with a = ½ (R f₀ + R' f₁) − γ g · up and the
/// gravity scale γ.
NavigationState propagate(const NavigationState& state, const InertialStep& step, double gravity_m_s2);
Transition transition(const NavigationState& state, const InertialStep& step, const InertialNoise& noise,
                      double gravity_m_s2);

NavigationState propagate(const NavigationState& state, const ConstantVelocityStep& step);
Transition transition(const NavigationState& state, const ConstantVelocityStep& step,
                      const ConstantVelocityNoise& noise);

/// P → F P Fᵀ + Q on the rows and columns that change.
void propagate_covariance(ErrorCovariance& p, const Transition& t);
/// The same, and what the present has in common with a past state.
void propagate_covariance(StateEstimate& estimate, const Transition& t);

}  // namespace spartan::internal
