// Updates by visual motions between frames.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "spartan/localization/internal/error_state_filter.h"
#include "spartan/localization/internal/kalman_update.h"
#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/internal/motion_composition.h"

namespace spartan::internal {
namespace {

/// Where vision contradicts the prediction, the standard deviation of the inflation is this factor times the residual;
/// empirical.
constexpr double kInflationFactor = 10;
/// Correlation length of the constant error of vision, in frames: finite, so that the filter does not become
/// overconfident; empirical.
constexpr double kConstantSteps = 5000;
/// Added to the variances of a motion (m², rad²), whose covariance may be singular.
constexpr double kMinVariance = 1e-14;

Matrix6d usable_covariance(const Matrix6d& covariance, double factor) {
  Matrix6d r = 0.5 * factor * (covariance + covariance.transpose());
  r.diagonal().array() += kMinVariance;
  return r;
}

/// The covariance of a motion whose errors may be as large as itself.
Matrix6d size_as_variance(const Pose& motion) {
  const Vector6d error = log_se3(motion);
  Matrix6d r = Matrix6d::Zero();
  r.diagonal().head<3>().setConstant(error.head<3>().squaredNorm());
  r.diagonal().tail<3>().setConstant(error.tail<3>().squaredNorm());
  return r;
}

// Position, attitude, velocity are the first errors.
static_assert(error_at::kPosition == 0 && error_at::kAttitude == 3 && error_at::kVelocity == 6);

}  // namespace

/// The same motion of the IMU.
VisualMotion ErrorStateFilter::of_imu(const RelativeMotion& motion) const {
  const Matrix6d& to_imu = arm_.to_imu();
  VisualMotion m;
  m.motion = motion;
  m.motion.previous_from_current = arm_.imu_motion(motion.previous_from_current);
  m.motion.covariance = to_imu * motion.covariance * to_imu.transpose();
  m.motion.by_calibration = to_imu * motion.by_calibration;
  m.motion.lasting_sigma.reset();  // the body's; D of the IMU is not diagonal
  if (!motion.is_stationary()) m.errors = {to_imu * motion.drift_scale().asDiagonal(), m.motion.by_calibration};
  return m;
}

void ErrorStateFilter::update(const RelativeMotion& of_body) {
  const VisualMotion visual = of_imu(of_body);
  const RelativeMotion& motion = visual.motion;
  advance_to(motion.to);
  SensorMonitor& monitor = memory_.monitor(LocalizationSensor::vision);
  const bool consecutive = motion.from == memory_.vision.clone_stamp;
  bool used = false;
  if (!motion.measured || !consecutive) {
    if (monitor.state != SensorState::excluded) monitor.state = SensorState::suspect;
    monitor.reason = HealthReason::lost;
    ++monitor.rejected;
    memory_.vision.stationary = false;
  } else {
    used = update_by_motion(visual);
    if (used) {
      const NavigationState& s = memory_.estimate.state;
      const double seconds = seconds_between(motion.from, motion.to);
      memory_.vision.rate_rad_s =
          log_so3(motion_since_clone(s, error_at::kVisionClone).clone_from_body.rotation()) / seconds;
    }
  }
  if (memory_.imu.known && !inertial_usable()) memory_.imu.window.add(motion);
  end_step_at_frame(motion.to, used && memory_.vision.constant_velocity_s > 0);
  // The clone stays over frames that are lost, as the landmarks of the odometry do.
  if (!consecutive || !motion.keeps_reference) begin_frame(motion.to);
}

/// Returns whether the motion was used.
bool ErrorStateFilter::update_by_motion(const VisualMotion& visual) {
  const RelativeMotion& motion = visual.motion;
  VisionMemory& vision = memory_.vision;
  vision.stationary = motion.is_stationary();
  if (!vision.stationary) {
    propagate_drift(error_at::kVisionDrift, drift_sigma_ratios_, options_.vision.drift_correlation_frames);
    propagate_drift(error_at::kVisionConstant, constant_sigma_ratios_, kConstantSteps);
  }
  Matrix6d covariance = usable_covariance(motion.own_covariance(), options_.vision.white_noise_factor);
  const Innovation innovation = relative_motion_innovation(memory_.estimate.state, error_at::kVisionClone,
                                                           motion.previous_from_current, covariance, visual.errors);
  const MotionEvidence evidence = evidence_of(visual, innovation);
  const MotionDecision decision = decide(evidence, gates_);
  learn_inclinometer(evidence);
  const bool velocity_was_reset = std::exchange(vision.reset, false);
  if (decision.accept_doubted) accept_doubted_motion();
  vision.doubted = decision.use == MotionUse::doubt;
  const bool accepted = accept_vision(decision);
  switch (decision.use) {
    case MotionUse::doubt:
      vision.doubted_at = motion.to;
      vision.doubted_pose = memory_.estimate.state.world_from_vision_clone * motion.previous_from_current;
      return false;
    case MotionUse::reject:
      return false;
    case MotionUse::reset:
      remember_motion(motion, false);
      reset_prediction(innovation, evidence.nis, motion);
      return true;
    case MotionUse::follow:
      if (!accepted) return false;
      remember_motion(motion, decision.uncertain);
      if (decision.uncertain) covariance += size_as_variance(motion.previous_from_current);
      follow_vision(visual, covariance);
      return true;
    case MotionUse::correct:
      if (!accepted) return false;
      remember_motion(motion, false);
      count_agreement_of_imu(velocity_was_reset);
      correct_motion(innovation, error_at::kVisionClone);
      return true;
  }
  return false;
}

bool ErrorStateFilter::accept_vision(const MotionDecision& decision) {
  SensorMonitor& monitor = memory_.monitor(LocalizationSensor::vision);
  const bool accepted = monitor.accept(decision.nis, decision.gate, decision.why, options_.health.excluded_after,
                                       options_.health.readmit_after);
  if (accepted && decision.uncertain) {
    monitor.state = SensorState::suspect;
    monitor.reason = HealthReason::implausible;
  }
  return accepted;
}

/// The prediction by an IMU that was suspect agrees with vision.
void ErrorStateFilter::count_agreement_of_imu(bool velocity_was_reset) {
  SensorMonitor& imu = memory_.monitor(LocalizationSensor::imu);
  if (imu.state != SensorState::suspect) return;
  const int failed = ends_contradictions(imu, velocity_was_reset, gates_) ? 0 : imu.failed_in_row;
  imu.readmit();
  imu.failed_in_row = failed;
}

/// Without an IMU the pose follows from the visual motion alone: a prediction with constant velocity would not be
/// independent of it, and after a stop it would be certain of a speed of zero.
void ErrorStateFilter::follow_vision(const VisualMotion& visual, const Matrix6d& covariance) {
  StateEstimate& e = memory_.estimate;
  compose_motion(e, visual.motion.previous_from_current, covariance, visual.errors);
  const Pose motion = motion_since_clone(e.state, error_at::kVisionClone).clone_from_body;
  memory_.world_from_odom = e.state.world_from_body * (memory_.vision.odom_from_clone * motion).inverse();
  // The end of a random walk of the velocity whose integral is known has a quarter of its variance.
  const double seconds = seconds_between(visual.motion.from, visual.motion.to);
  const ConstantVelocityOptions& o = options_.constant_velocity;
  const double walk = o.speed_sigma_ratio_per_sqrt_s * (motion.translation().norm() / seconds + o.speed_offset_m_s);
  set_velocity(e, motion, seconds, 0.25 * walk * walk * seconds);
}

/// One step of a Gauss–Markov process.
void ErrorStateFilter::propagate_drift(int index, const Vector6d& sigmas, double steps) {
  const double stays = std::exp(-1 / steps);
  NavigationState& s = memory_.estimate.state;
  ErrorCovariance& p = memory_.estimate.covariance;
  (index == error_at::kVisionDrift ? s.vision_drift : s.vision_constant) *= stays;
  p.middleRows<6>(index) *= stays;
  p.middleCols<6>(index) *= stays;
  if (memory_.estimate.past) memory_.estimate.past->with_present.middleCols<6>(index) *= stays;
  p.diagonal().segment<6>(index) += (1 - stays * stays) * sigmas.cwiseAbs2();
}

/// Inflates the covariance of the motion since the last frame until the prediction has no weight against a motion with
/// that innovation.
void ErrorStateFilter::inflate_prediction(const Innovation& innovation, const RelativeMotion& motion) {
  const double seconds = std::max(seconds_between(motion.from, motion.to), 1e-3);
  const double shift = kInflationFactor * innovation.residual.head<3>().norm(),
               turn = kInflationFactor * innovation.residual.tail<3>().norm();
  const ConstantVelocityNoise noise{(shift + 1e-3) * std::sqrt(3 / (seconds * seconds * seconds)),
                                    (turn + 1e-4) / std::sqrt(seconds)};
  const ConstantVelocityStep step{Eigen::Vector3d::Zero(), seconds};
  memory_.estimate.covariance.topLeftCorner<9, 9>() +=
      transition(memory_.estimate.state, step, noise).noise.topLeftCorner<9, 9>();
}

/// Vision contradicts the prediction by the IMU, and no other sensor confirms it: inflates the prediction, and counts a
/// rejection of the IMU.
void ErrorStateFilter::reset_prediction(const Innovation& innovation, double nis, const RelativeMotion& motion) {
  inflate_prediction(innovation, motion);
  memory_.vision.reset = true;
  memory_.step.stationary = false;
  memory_.monitor(LocalizationSensor::imu)
      .accept(nis, gates_.vision, HealthReason::contradicted, options_.health.excluded_after,
              options_.health.readmit_after);
  correct_motion(innovation, error_at::kVisionClone);
}

/// Vision is contradicted a second time, so the motion before was right: what followed is moved to where it ended.
/// odom_from_body is preserved.
void ErrorStateFilter::accept_doubted_motion() {
  NavigationState& s = memory_.estimate.state;
  const Pose moved = memory_.vision.doubted_pose * s.world_from_vision_clone.inverse();
  s.world_from_body = moved * s.world_from_body;
  s.world_from_vision_clone = moved * s.world_from_vision_clone;
  s.world_from_step_clone = moved * s.world_from_step_clone;
  memory_.world_from_odom = moved * memory_.world_from_odom;
}

/// The next visual motion starts at this pose.
void ErrorStateFilter::begin_frame(Stamp stamp) {
  const UncertainPose odom = odom_from_imu();
  memory_.vision.odom_from_clone = odom.pose;
  memory_.vision.odom_covariance = odom.covariance;
  memory_.vision.clone_stamp = stamp;
  const std::optional<WheelSample> wheels = wheels_at(stamp);
  memory_.vision.has_wheels = wheels.has_value();
  if (wheels) memory_.vision.wheels = *wheels;
  const std::optional<InclinometerSample> tilt = tilt_at(stamp);
  memory_.vision.has_tilt = tilt.has_value();
  if (tilt) memory_.vision.tilt = *tilt;
  memory_.vision.wheels_in_prediction = false;
  memory_.vision.constant_velocity_noise.setZero();
  memory_.vision.constant_velocity_s = 0;
  clone_pose(memory_.estimate, error_at::kVisionClone);
}

}  // namespace spartan::internal
