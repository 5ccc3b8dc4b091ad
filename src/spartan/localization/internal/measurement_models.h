// Measurement models: innovations (residual, Jacobian, noise) of each kind of measurement.
#pragma once

#include "spartan/camera/samples.h"
#include "spartan/core/trajectory.h"
#include "spartan/localization/internal/error_state.h"
#include "spartan/localization/internal/kalman_update.h"

namespace spartan::internal {

/// How the errors that last act on a motion (all zero: they do not).
struct MotionErrors {
  Matrix6d drift = Matrix6d::Zero();  ///< D
  /// E (RelativeMotion::by_calibration).
  Eigen::Matrix<double, 6, 8> by_calibration = Eigen::Matrix<double, 6, 8>::Zero();
};

/// d̂ = D ẑ + E η̂, the estimate of the errors that last.
Vector6d lasting_error(const NavigationState& state, const MotionErrors& errors);

/// A motion measured from a clone (`index`: kVisionClone or kStepClone) to the present pose, M = Ĉ⁻¹ X̂ Exp(e) with
/// noise n, drift z and errors of the calibration η on the right, M = … Exp(−d − n) with d = D z + E η. After
/// correction by the estimate d̂,
///   r = Log(M̂⁻¹ M Exp(d̂)) = J_l⁻¹(r) (ξ_x − Ad(M̂⁻¹) ξ_c) − J_r⁻¹(r) J_r(d̂) (D δz + E δη + n)
/// linearized at the estimate. A shift of the whole drive, ξ_x = Ad(M̂⁻¹) ξ_c, has no effect, whatever r: with other
/// factors before ξ_x and ξ_c the noise of r would seem to measure it (Huang, Mourikis & Roumeliotis, IJRR 2010).
Innovation relative_motion_innovation(const NavigationState& state, int clone, const Pose& measured,
                                      const Matrix6d& covariance, const MotionErrors& errors);

/// The estimated motion since a clone, with the Jacobian of its right perturbation.
struct MotionSinceClone {
  Pose clone_from_body;
  Eigen::Matrix<double, 6, error_at::kSize> jacobian;
};
MotionSinceClone motion_since_clone(const NavigationState& state, int clone);

/// One step of the wheels: forward s·d, zero to the side and up, rotation (d_r − d_l)/track about z. The body moves
/// along its mean attitude: t_mid = Exp(φ/2)ᵀ t. Rows: forward, side, up, and yaw if the track is known.
struct WheelStep {
  double counted_m = 0;  ///< mean of both sides
  double yaw_rad = 0;
  bool yaw_known = false;
  double forward_sigma_m = 0, side_sigma_m = 0, up_sigma_m = 0, yaw_sigma_rad = 0;
};
/// `centre`: the turning centre of the wheels, relative to the pose of the state.
Innovation wheel_innovation(const NavigationState& state, const WheelStep& step, const Eigen::Vector3d& centre);
/// Displacement along body x of the mean attitude of a motion of the turning centre, as wheels measure it.
double forward_of(const Pose& motion);
/// The same of the motion since a clone, with its Jacobian.
struct StepForward {
  double metres = 0;
  Eigen::Matrix<double, 1, error_at::kSize> jacobian;
};
StepForward forward_since(const NavigationState& state, int clone, const Eigen::Vector3d& centre);

/// Heading of body x in the world, counter-clockwise from x.
double heading_of(const Pose& world_from_body);
/// Heading of body x about the true vertical: of Exp(−τ) R x̂ with the tilt τ.
double heading_about_up(const NavigationState& state);
/// Reading = heading about the true vertical + offset; the residual is wrapped to ±π.
Innovation compass_innovation(const NavigationState& state, double heading_rad, double sigma_rad);

/// Roll and pitch of the body relative to the true vertical: up in the body frame is (−sin p, sin r cos p, cos r cos
/// p).
Eigen::Vector2d roll_pitch_of_up(const Eigen::Vector3d& up_in_body);
Eigen::Vector3d up_of_roll_pitch(double roll_rad, double pitch_rad);
Innovation inclinometer_innovation(const NavigationState& state, double roll_rad, double pitch_rad, double sigma_rad);

/// Unit vector opposite to gravity in the body frame of a pose (kPose or a clone), with its Jacobian.
struct UpInBody {
  Eigen::Vector3d up;
  Eigen::Matrix<double, 3, error_at::kSize> jacobian;
};
UpInBody up_in_body(const NavigationState& state, int pose);

/// Mean specific force of a body that does not accelerate: R̂ᵀ g up + accel bias.
Innovation rest_innovation(const NavigationState& state, const Eigen::Vector3d& mean_accel_m_s2, double sigma_m_s2,
                           double gravity_m_s2);

/// Map constraint on the pose whose error is at `pose` (kPose or kVisionClone): one row for each direction with
/// information. Rows are independent but for the error of the map; its cross-covariance with the error of the estimate
/// (shared_fraction) acts on the state through the pose. No rows if there is no information.
Innovation map_innovation(const StateEstimate& estimate, int pose, const PoseConstraint& constraint,
                          double covariance_factor);

}  // namespace spartan::internal
