// The state of the localization filter and the error it estimates (docs/math/localization.md, "State").
//
// Pose errors are right perturbations, T = T̂ Exp(ξ) with ξ = (ρ, φ), all others are added. Sources: Solà, "Quaternion
// kinematics for the error-state Kalman filter", 2017; Solà et al. 2018, "A micro Lie theory …", for the Jacobians.
#pragma once

#include <Eigen/Core>

#include "spartan/core/pose.h"

namespace spartan {

/// Where each part of the error begins.
namespace error_at {
inline constexpr int kPose = 0;  ///< of world_from_body: translation, rotation
inline constexpr int kPosition = 0, kAttitude = 3;
inline constexpr int kVelocity = 6;    ///< m/s, body
inline constexpr int kGyroBias = 9;    ///< rad/s, body
inline constexpr int kAccelBias = 12;  ///< m/s², body
inline constexpr int kMoving = 15;     ///< all before this changes with time
inline constexpr int kGravityTilt = 15;
inline constexpr int kWheelScale = 17;
inline constexpr int kCompassOffset = 18;
inline constexpr int kInclinometerBias = 19;
inline constexpr int kVisionDrift = 21;
inline constexpr int kVisionConstant = 27;
inline constexpr int kVisionClone = 33;  ///< of the pose at the last shot
inline constexpr int kStepClone = 39;    ///< of the pose where the present step of the wheels began
inline constexpr int kSize = 45;
}  // namespace error_at

using ErrorVector = Eigen::Matrix<double, error_at::kSize, 1>;
using ErrorCovariance = Eigen::Matrix<double, error_at::kSize, error_at::kSize>;

struct NavigationState {
  Pose world_from_body;
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();     ///< body: there vision and wheels measure it, whatever
                                                              ///< the attitude in the world
  Eigen::Vector3d gyro_bias_rad_s = Eigen::Vector3d::Zero();  ///< body
  Eigen::Vector3d accel_bias_m_s2 = Eigen::Vector3d::Zero();  ///< body
  /// Rotation vector (x, y) that turns the world's z to the true vertical: the first pose defines the world exactly,
  /// so it is gravity that is uncertain in it.
  Eigen::Vector2d gravity_tilt_rad = Eigen::Vector2d::Zero();
  double wheel_scale = 1;                                           ///< travelled over counted distance
  double compass_offset_rad = 0;                                    ///< a reading less the heading in the world
  Eigen::Vector2d inclinometer_bias_rad = Eigen::Vector2d::Zero();  ///< roll, pitch
  /// Lasting errors of visual motions, in stated standard deviations: one that changes slowly, one of the whole drive.
  Vector6d vision_drift = Vector6d::Zero(), vision_constant = Vector6d::Zero();
  Pose world_from_vision_clone, world_from_step_clone;
};

/// The estimate and the covariance of its error.
struct Belief {
  NavigationState state;
  ErrorCovariance covariance = ErrorCovariance::Zero();
};

NavigationState add_error(const NavigationState& state, const ErrorVector& error);
/// The error that leads from a to b: inverse of add_error.
ErrorVector error_between(const NavigationState& a, const NavigationState& b);

/// Unit vector against gravity, in the world.
Eigen::Vector3d true_up(const Eigen::Vector2d& tilt);
/// ∂ true_up / ∂ tilt.
Eigen::Matrix<double, 3, 2> true_up_jacobian(const Eigen::Vector2d& tilt);
/// The tilt whose true_up has this direction; the direction must not point down.
Eigen::Vector2d tilt_of_up(const Eigen::Vector3d& up_in_world);

/// Makes the clone at `index` (kVisionClone or kStepClone) a copy of the present pose, with all its correlations.
/// Source: Roumeliotis & Burdick, "Stochastic cloning", ICRA 2002.
void clone_pose(Belief& belief, int index);

}  // namespace spartan
