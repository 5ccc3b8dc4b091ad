// State and error state of the localization filter (docs/math/localization.md, "State").
//
// Pose errors are right perturbations, T = T̂ Exp(ξ) with ξ = (ρ, φ), all others are added. Sources: Solà, "Quaternion
// kinematics for the error-state Kalman filter", 2017; Solà et al. 2018, "A micro Lie theory …", for the Jacobians.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "spartan/core/pose.h"

namespace spartan::internal {

/// Index of the first element of each part of the error.
namespace error_at {
inline constexpr int kPose = 0;  ///< of world_from_body: translation, rotation
inline constexpr int kPosition = 0, kAttitude = 3;
inline constexpr int kVelocity = 6;    ///< m/s, body
inline constexpr int kGyroBias = 9;    ///< rad/s, body
inline constexpr int kAccelBias = 12;  ///< m/s², body
inline constexpr int kMoving = 15;     ///< errors before this index are propagated
inline constexpr int kGravityTilt = kMoving;
inline constexpr int kGravityScale = kGravityTilt + 2;
inline constexpr int kImuTime = kGravityScale + 1;
inline constexpr int kWheelScale = kImuTime + 1;
inline constexpr int kCompassOffset = kWheelScale + 1;
inline constexpr int kInclinometerBias = kCompassOffset + 1;
inline constexpr int kVisionDrift = kInclinometerBias + 2;
inline constexpr int kVisionConstant = kVisionDrift + 6;
inline constexpr int kCalibration = kVisionConstant + 6;
inline constexpr int kVisionClone = kCalibration + 8;  ///< of the pose at the last frame
inline constexpr int kStepClone = kVisionClone + 6;    ///< of the pose at the start of the current wheel step
inline constexpr int kSize = kStepClone + 6;
}  // namespace error_at

using ErrorVector = Eigen::Matrix<double, error_at::kSize, 1>;
using ErrorCovariance = Eigen::Matrix<double, error_at::kSize, error_at::kSize>;

using Vector8d = Eigen::Matrix<double, 8, 1>;

struct NavigationState {
  Pose world_from_body;                                       ///< of the IMU, with the axes of the body (lever_arm.h)
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();     ///< body frame: vision and wheels measure it there,
                                                              ///< independently of the attitude
  Eigen::Vector3d gyro_bias_rad_s = Eigen::Vector3d::Zero();  ///< body
  Eigen::Vector3d accel_bias_m_s2 = Eigen::Vector3d::Zero();  ///< body
  /// Rotation vector (x, y) from the world's z axis to the true vertical: the first pose defines the world exactly, so
  /// that the direction of gravity is what is uncertain.
  Eigen::Vector2d gravity_tilt_rad = Eigen::Vector2d::Zero();
  /// Measured over true gravity: the scale error of the accelerometer where it matters.
  double gravity_scale = 1;
  double imu_time_offset_s = 0;                                     ///< stamp of the IMU minus stamp of the cameras
  double wheel_scale = 1;                                           ///< travelled over counted distance
  double compass_offset_rad = 0;                                    ///< reading − heading in the world
  Eigen::Vector2d inclinometer_bias_rad = Eigen::Vector2d::Zero();  ///< roll, pitch
  /// Drift of vision in standard deviations of a visual motion: a slowly changing part and one that is constant over
  /// the drive.
  Vector6d vision_drift = Vector6d::Zero(), vision_constant = Vector6d::Zero();
  /// Errors of the calibration of the cameras, in their standard deviations (RelativeMotion::by_calibration).
  Vector8d calibration = Vector8d::Zero();
  Pose world_from_vision_clone, world_from_step_clone;
};

/// What later measurements say about the error at an earlier time (past_state.h).
struct PastState {
  ErrorVector mean = ErrorVector::Zero();                  ///< of the error at the earlier time
  ErrorCovariance covariance = ErrorCovariance::Zero();    ///< of the error at the earlier time
  ErrorCovariance with_present = ErrorCovariance::Zero();  ///< E[past error · present errorᵀ]
};

/// Mean and covariance of the error.
struct StateEstimate {
  NavigationState state;
  ErrorCovariance covariance = ErrorCovariance::Zero();
  std::optional<PastState> past{};  ///< tracked where a smoother needs it
};

NavigationState add_error(const NavigationState& state, const ErrorVector& error);
/// The error from a to b: inverse of add_error.
ErrorVector error_between(const NavigationState& a, const NavigationState& b);

/// Unit vector opposite to gravity, world frame.
Eigen::Vector3d true_up(const Eigen::Vector2d& tilt);
/// ∂ true_up / ∂ tilt.
Eigen::Matrix<double, 3, 2> true_up_jacobian(const Eigen::Vector2d& tilt);
/// Inverse of true_up; the direction must not point down.
Eigen::Vector2d tilt_of_up(const Eigen::Vector3d& up_in_world);

/// Makes the clone at `index` (kVisionClone or kStepClone) a copy of the current pose, with all its correlations.
/// Source: Roumeliotis & Burdick, "Stochastic cloning", ICRA 2002.
void clone_pose(StateEstimate& estimate, int index);

}  // namespace spartan::internal
