// How state and covariance move on with time: with an IMU, or without one.
#pragma once

#include <Eigen/Core>

#include "spartan/localization/internal/error_state.h"

namespace spartan {

/// Readings of the IMU at both ends of a step.
struct InertialStep {
  Eigen::Vector3d gyro_from, gyro_to;    ///< rad/s
  Eigen::Vector3d accel_from, accel_to;  ///< specific force, m/s²
  double seconds = 0;
};

/// White noise by density, random walks by density.
struct InertialNoise {
  double gyro = 0, accel = 0, gyro_walk = 0, accel_walk = 0;
};

/// Where the rover keeps its velocity in the body frame and turns at `rate`, but for noise.
struct SteadyStep {
  Eigen::Vector3d rate_rad_s;
  double seconds = 0;
};
struct SteadyNoise {
  double velocity_m_s_sqrt_hz = 0, attitude_rad_sqrt_hz = 0;
};

/// The moving part of the error after a step: by · error before (all of it) + noise of covariance `noise`.
struct Transition {
  Eigen::Matrix<double, error_at::kMoving, error_at::kMoving> by_moving;
  Eigen::Matrix<double, error_at::kMoving, 2> by_tilt;
  Eigen::Matrix<double, error_at::kMoving, error_at::kMoving> noise;
};

/// Mid-point integration: the mean rate turns; the mean of the specific forces at both ends, each turned into the
/// world, accelerates. p' = p + v t + ½ a t², v' = v + a t in the world, with a = ½ (R f₀ + R' f₁) − g · up.
NavigationState propagate(const NavigationState& state, const InertialStep& step, double gravity_m_s2);
Transition transition(const NavigationState& state, const InertialStep& step, const InertialNoise& noise,
                      double gravity_m_s2);

NavigationState propagate(const NavigationState& state, const SteadyStep& step);
Transition transition(const NavigationState& state, const SteadyStep& step, const SteadyNoise& noise);

/// P → F P Fᵀ + Q, touching only what changes.
void move_on(ErrorCovariance& p, const Transition& t);

}  // namespace spartan
