#include "spartan/localization/internal/updates/motion_update.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "spartan/localization/internal/motion_composition.h"
#include "spartan/localization/internal/propagation.h"
#include "spartan/localization/internal/updates/filter_correction.h"
#include "spartan/localization/internal/updates/motion_plausibility.h"
#include "spartan/localization/internal/updates/wheel_step.h"

namespace spartan::internal {
namespace {

/// Where vision contradicts the prediction, the standard deviation of the inflation is this factor times the residual;
/// empirical.
constexpr double kInflationFactor = 10;
/// Added to the variances of a motion (m², rad²), whose covariance may be singular.
constexpr double kMinVariance = 1e-14;

// Position, attitude, velocity are the first errors.
static_assert(error_at::kPosition == 0 && error_at::kAttitude == 3 && error_at::kVelocity == 6);

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

/// Inflates the covariance of the motion since the last frame until the prediction has no weight against a motion with
/// that innovation.
void inflate_prediction(StateEstimate& estimate, const Innovation& innovation, const RelativeMotion& motion) {
  const double seconds = std::max(seconds_between(motion.from, motion.to), 1e-3);
  const double shift = kInflationFactor * innovation.residual.head<3>().norm(),
               turn = kInflationFactor * innovation.residual.tail<3>().norm();
  const ConstantVelocityNoise noise{(shift + 1e-3) * std::sqrt(3 / (seconds * seconds * seconds)),
                                    (turn + 1e-4) / std::sqrt(seconds)};
  const ConstantVelocityStep step{Eigen::Vector3d::Zero(), seconds};
  estimate.covariance.topLeftCorner<9, 9>() += transition(estimate.state, step, noise).noise.topLeftCorner<9, 9>();
}

/// Vision is contradicted a second time, so the motion before was right: what followed is moved to where it ended.
/// odom_from_body is preserved.
void accept_doubted_motion(FilterMemory& memory) {
  NavigationState& s = memory.estimate.state;
  const Pose moved = memory.vision.doubted_pose * s.world_from_vision_clone.inverse();
  s.world_from_body = moved * s.world_from_body;
  s.world_from_vision_clone = moved * s.world_from_vision_clone;
  s.world_from_step_clone = moved * s.world_from_step_clone;
  memory.world_from_odom = moved * memory.world_from_odom;
}

void count_lost_motion(FilterMemory& memory) {
  SensorMonitor& monitor = memory.monitor(LocalizationSensor::vision);
  if (monitor.state != SensorState::excluded) monitor.state = SensorState::suspect;
  monitor.reason = HealthReason::lost;
  ++monitor.rejected;
  memory.vision.stationary = false;
}

/// The next visual motion starts at this pose.
void begin_frame(FilterMemory& memory, Stamp stamp) {
  const UncertainPose odom = odom_from_imu(memory);
  VisionMemory& vision = memory.vision;
  vision.odom_from_clone = odom.pose;
  vision.odom_covariance = odom.covariance;
  vision.clone_stamp = stamp;
  const std::optional<WheelSample> wheels = wheels_at(memory.wheels, stamp);
  vision.has_wheels = wheels.has_value();
  if (wheels) vision.wheels = *wheels;
  const std::optional<InclinometerSample> tilt = tilt_at(memory.inclinometer, stamp);
  vision.has_tilt = tilt.has_value();
  if (tilt) vision.tilt = *tilt;
  vision.wheels_in_prediction = false;
  vision.constant_velocity_noise.setZero();
  vision.constant_velocity_s = 0;
  clone_pose(memory.estimate, error_at::kVisionClone);
}

}  // namespace

MotionUpdate::MotionUpdate(const LocalizationOptions& options)
    : arm_(options.imu.position_m),
      white_noise_factor_(options.vision.white_noise_factor),
      constant_velocity_(options.constant_velocity),
      gates_(options),
      drift_(options.vision),
      witnesses_(options),
      wheels_(options) {}

void MotionUpdate::update(FilterMemory& memory, const RelativeMotion& of_body) const {
  const VisualMotion visual = VisualMotion::of_imu(of_body, arm_);
  const RelativeMotion& motion = visual.motion;
  const bool consecutive = motion.from == memory.vision.clone_stamp;
  bool used = false;
  if (!motion.measured || !consecutive) {
    count_lost_motion(memory);
  } else {
    used = update_by_motion(memory, visual);
  }
  if (used) {
    const double seconds = seconds_between(motion.from, motion.to);
    memory.vision.rate_rad_s =
        log_so3(motion_since_clone(memory.estimate.state, error_at::kVisionClone).clone_from_body.rotation()) / seconds;
  }
  if (memory.imu.known && !memory.inertial_usable()) memory.imu.window.add(motion);
  wheels_.end_step_at_frame(memory, motion.to, used && memory.vision.constant_velocity_s > 0);
  // The clone stays over frames that are lost, as the landmarks of the odometry do.
  if (!consecutive || !motion.keeps_reference) begin_frame(memory, motion.to);
}

/// Returns whether the motion was used.
bool MotionUpdate::update_by_motion(FilterMemory& memory, const VisualMotion& visual) const {
  const RelativeMotion& motion = visual.motion;
  VisionMemory& vision = memory.vision;
  vision.stationary = motion.is_stationary();
  if (!vision.stationary) drift_.propagate(memory.estimate);
  Matrix6d covariance = usable_covariance(motion.own_covariance(), white_noise_factor_);
  const Innovation innovation = relative_motion_innovation(memory.estimate.state, error_at::kVisionClone,
                                                           motion.previous_from_current, covariance, visual.errors);
  const MotionEvidence evidence = witnesses_.evidence_of(memory, visual, innovation);
  const MotionDecision decision = decide(evidence, gates_.limits());
  learn_inclinometer(memory.inclinometer, evidence);
  const bool velocity_was_reset = std::exchange(vision.reset, false);
  if (decision.accept_doubted) accept_doubted_motion(memory);
  vision.doubted = decision.use == MotionUse::doubt;
  const bool accepted = accept(memory, decision, evidence);
  switch (decision.use) {
    case MotionUse::doubt:
      vision.doubted_at = motion.to;
      vision.doubted_pose = memory.estimate.state.world_from_vision_clone * motion.previous_from_current;
      return false;
    case MotionUse::reject:
      return false;
    case MotionUse::reset:
      remember(vision.recent, motion, false);
      reset_prediction(memory, innovation, evidence.nis, motion);
      return true;
    case MotionUse::follow:
      if (!accepted) return false;
      remember(vision.recent, motion, decision.uncertain);
      if (decision.uncertain) covariance += size_as_variance(motion.previous_from_current);
      follow(memory, visual, covariance);
      return true;
    case MotionUse::correct:
      if (!accepted) return false;
      remember(vision.recent, motion, false);
      count_agreement_of_imu(memory, velocity_was_reset);
      correct_motion(memory, innovation, error_at::kVisionClone);
      return true;
  }
  return false;
}

bool MotionUpdate::accept(FilterMemory& memory, const MotionDecision& decision, const MotionEvidence& evidence) const {
  const std::optional<double> tested = evidence.predicted_by_imu ? std::optional(evidence.nis) : std::nullopt;
  const bool accepted = gates_.accept_motion(memory, decision, tested);
  if (accepted && decision.uncertain) {
    SensorMonitor& monitor = memory.monitor(LocalizationSensor::vision);
    monitor.state = SensorState::suspect;
    monitor.reason = HealthReason::implausible;
  }
  return accepted;
}

/// The prediction by an IMU that was suspect agrees with vision.
void MotionUpdate::count_agreement_of_imu(FilterMemory& memory, bool velocity_was_reset) const {
  SensorMonitor& imu = memory.monitor(LocalizationSensor::imu);
  if (imu.state != SensorState::suspect) return;
  const int failed = ends_contradictions(imu, velocity_was_reset, gates_.limits()) ? 0 : imu.failed_in_row;
  imu.readmit();
  imu.failed_in_row = failed;
}

/// Without an IMU the pose follows from the visual motion alone: a prediction with constant velocity would not be
/// independent of it, and after a stop it would be certain of a speed of zero.
void MotionUpdate::follow(FilterMemory& memory, const VisualMotion& visual, const Matrix6d& covariance) const {
  StateEstimate& e = memory.estimate;
  compose_motion(e, visual.motion.previous_from_current, covariance, visual.errors);
  set_odom_by_motion(memory, error_at::kVisionClone);
  // The end of a random walk of the velocity whose integral is known has a quarter of its variance.
  const Pose motion = motion_since_clone(e.state, error_at::kVisionClone).clone_from_body;
  const double seconds = seconds_between(visual.motion.from, visual.motion.to);
  const ConstantVelocityOptions& o = constant_velocity_;
  const double walk = o.speed_sigma_ratio_per_sqrt_s * (motion.translation().norm() / seconds + o.speed_offset_m_s);
  set_velocity(e, motion, seconds, 0.25 * walk * walk * seconds);
}

/// Vision contradicts the prediction by the IMU, and no other sensor confirms it: inflates the prediction, and counts a
/// rejection of the IMU.
void MotionUpdate::reset_prediction(FilterMemory& memory, const Innovation& innovation, double nis,
                                    const RelativeMotion& motion) const {
  inflate_prediction(memory.estimate, innovation, motion);
  memory.vision.reset = true;
  memory.step.stationary = false;
  gates_.accept_within(memory, LocalizationSensor::imu, nis, gates_.limits().vision, HealthReason::contradicted);
  correct_motion(memory, innovation, error_at::kVisionClone);
}

}  // namespace spartan::internal
