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
/// The IMU and the wheels agree where they differ by fewer standard deviations; vision is outvoted by them where it
/// differs from the IMU by as many and from the mean of both by more than kOutvotedSigmas.
constexpr double kAgreeSigmas = 3, kOutvotedSigmas = 5;
/// A visual motion is wild where the IMU or the wheels contradict it by this factor times the gate: 12 standard
/// deviations.
constexpr double kWildFactor = 4;
/// A contradiction is gross beyond this factor times the gate: 60 standard deviations.
constexpr double kGrossFactor = 100;
/// Added to the variances of a motion (m², rad²), whose covariance may be singular.
constexpr double kMinVariance = 1e-14;

Matrix6d usable_covariance(const Matrix6d& covariance, double factor) {
  Matrix6d r = 0.5 * factor * (covariance + covariance.transpose());
  r.diagonal().array() += kMinVariance;
  return r;
}

double translation_nis(const ErrorCovariance& covariance, const Innovation& innovation) {
  Innovation shift(3);
  shift.residual = innovation.residual.head<3>();
  shift.jacobian = innovation.jacobian.topRows<3>();
  shift.noise = innovation.noise.topLeftCorner<3, 3>();
  return normalized_innovation_squared(covariance, shift);
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
  const bool inertial = vision.constant_velocity_s == 0, was_reset = std::exchange(vision.reset, false);
  const Matrix6d covariance = usable_covariance(motion.own_covariance(), options_.vision.white_noise_factor);
  const Innovation innovation = relative_motion_innovation(memory_.estimate.state, error_at::kVisionClone,
                                                           motion.previous_from_current, covariance, visual.errors);
  const double nis = inertial ? normalized_innovation_squared(memory_.estimate.covariance, innovation) : 0;
  const auto forward = inertial ? compare_forward(visual) : std::nullopt;
  constexpr double kOutvoted = kOutvotedSigmas * kOutvotedSigmas;
  if (forward && forward->imu_and_wheels_agree && forward->vision_contradicts_imu && forward->vision_nis > kOutvoted)
    return accept_vision(forward->vision_nis, kOutvoted, HealthReason::outvoted);
  if (doubt_motion(visual, innovation, nis)) return false;

  if (!inertial) {
    if (!accept_vision(0, vision_gate_, HealthReason::none)) return false;
    follow_vision(visual, covariance);
    return true;
  }
  if (nis > vision_gate_) {
    // Vision that is excluded resets the prediction only where the wheels contradict the IMU, too.
    const bool wheels_contradict_imu = forward && !forward->imu_and_wheels_agree;
    if (memory_.monitor(LocalizationSensor::vision).state == SensorState::excluded && !wheels_contradict_imu)
      return accept_vision(nis, vision_gate_, HealthReason::disagrees);
    return reset_prediction(innovation, nis, motion);
  }
  if (!accept_vision(nis, vision_gate_, HealthReason::disagrees)) return false;
  SensorMonitor& imu = memory_.monitor(LocalizationSensor::imu);
  if (imu.state == SensorState::suspect) {  // its prediction agrees with vision
    const int failed = imu.failed_in_row;
    imu.readmit();
    // With the velocity of a reset prediction anything agrees, which does not end a series of gross contradictions.
    if (was_reset && imu.nis > kGrossFactor * vision_gate_) imu.failed_in_row = failed;
  }
  correct_motion(innovation, error_at::kVisionClone);
  return true;
}

bool ErrorStateFilter::accept_vision(double nis, double gate, HealthReason why) {
  return memory_.monitor(LocalizationSensor::vision)
      .accept(nis, gate, why, options_.health.excluded_after, options_.health.readmit_after);
}

/// Rejects a single wild motion, which is a fault of vision. If the next one is contradicted, too, the other sensor is
/// wrong: then the motion before is accepted after all.
bool ErrorStateFilter::doubt_motion(const VisualMotion& visual, const Innovation& innovation, double nis) {
  VisionMemory& vision = memory_.vision;
  const RelativeMotion& motion = visual.motion;
  const bool is_wild = is_wild_motion(visual, innovation, nis);
  const bool was_doubted = vision.doubted && vision.doubted_at == motion.from;
  vision.doubted = is_wild && !was_doubted && !motion.keeps_reference &&
                   memory_.monitor(LocalizationSensor::vision).state != SensorState::excluded;
  if (vision.doubted) {
    vision.doubted_at = motion.to;
    vision.doubted_pose = memory_.estimate.state.world_from_vision_clone * motion.previous_from_current;
    accept_vision(std::max(nis, kWildFactor * vision_gate_), vision_gate_, HealthReason::wild);
  } else if (was_doubted && (is_wild || nis > vision_gate_)) {
    accept_doubted_motion();
  }
  return vision.doubted;
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
bool ErrorStateFilter::reset_prediction(const Innovation& innovation, double nis, const RelativeMotion& motion) {
  inflate_prediction(innovation, motion);
  memory_.vision.reset = true;
  memory_.step.stationary = false;
  memory_.monitor(LocalizationSensor::imu)
      .accept(nis, vision_gate_, HealthReason::contradicted, options_.health.excluded_after,
              options_.health.readmit_after);
  accept_vision(0, vision_gate_, HealthReason::none);
  correct_motion(innovation, error_at::kVisionClone);
  return true;
}

/// Whether the IMU or the wheels contradict the motion by far. The wheels decide where they can: by their count since
/// the last frame, or, without an IMU, if that is in the prediction already, by the predicted distance. Wheels that
/// were excluded, because the IMU contradicts them, still confirm a motion, but do not contradict it.
bool ErrorStateFilter::is_wild_motion(const VisualMotion& visual, const Innovation& innovation,
                                      double inertial_nis) const {
  const bool wheels_ok = memory_.monitor(LocalizationSensor::wheels).state == SensorState::ok;
  const std::optional<double> against_wheels = compare_with_wheels(visual);
  if (wheels_ok && against_wheels && *against_wheels > kWildFactor * gates_[4]) return true;
  if (memory_.vision.constant_velocity_s == 0) {
    return memory_.monitor(LocalizationSensor::imu).state == SensorState::ok &&
           inertial_nis > kWildFactor * vision_gate_ && !(against_wheels && *against_wheels <= gates_[4]);
  }
  return wheels_ok && memory_.vision.wheels_in_prediction && against_wheels &&
         translation_nis(memory_.estimate.covariance, innovation) > kWildFactor * gates_[3];
}

/// The step of the wheels since the last frame. None if they cannot tell.
std::optional<WheelStep> ErrorStateFilter::wheel_step_since_frame(Stamp stamp) const {
  const std::optional<WheelSample> wheels = wheels_at(stamp);
  if (!wheels || !memory_.vision.has_wheels) return std::nullopt;
  return step_between(memory_.vision.wheels, *wheels);
}

/// NIS of the visual motion against the count of the wheels since the last frame, if they can tell.
std::optional<double> ErrorStateFilter::compare_with_wheels(const VisualMotion& visual) const {
  const RelativeMotion& motion = visual.motion;
  const std::optional<WheelStep> step = wheel_step_since_frame(motion.to);
  if (!step) return std::nullopt;
  NavigationState seen;
  seen.world_from_body = motion.previous_from_current;
  seen.wheel_scale = memory_.estimate.state.wheel_scale;
  ErrorCovariance p = ErrorCovariance::Zero();
  p.topLeftCorner<6, 6>() = motion.covariance;
  p(error_at::kWheelScale, error_at::kWheelScale) =
      memory_.estimate.covariance(error_at::kWheelScale, error_at::kWheelScale);
  return normalized_innovation_squared(p, wheel_innovation(seen, *step, wheel_centre_));
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

/// Distance along the body's x since the last frame, by the wheels, by the IMU and by vision. A repeating texture
/// shifts a visual motion by its period, with a small covariance. None if the wheels cannot tell.
std::optional<ForwardComparison> ErrorStateFilter::compare_forward(const VisualMotion& visual) const {
  const RelativeMotion& motion = visual.motion;
  const std::optional<WheelStep> step = wheel_step_since_frame(motion.to);
  if (!step || memory_.vision.wheels_in_prediction ||
      memory_.monitor(LocalizationSensor::wheels).state == SensorState::excluded)
    return std::nullopt;
  const NavigationState& s = memory_.estimate.state;
  const ErrorCovariance& p = memory_.estimate.covariance;
  const double counted_m = s.wheel_scale * step->counted_m;
  const double counted_variance = std::pow(step->forward_sigma_m, 2) +
                                  p(error_at::kWheelScale, error_at::kWheelScale) * step->counted_m * step->counted_m;
  const StepForward predicted = forward_since(s, error_at::kVisionClone, wheel_centre_);
  const double predicted_variance = predicted.jacobian * p * predicted.jacobian.transpose();
  // As in relative_motion_innovation(): white noise, and the errors that last.
  const Pose to_centre = Pose::from_translation(wheel_centre_);
  const double seen_m = forward_of(to_centre.inverse() * motion.previous_from_current *
                                   exp_se3(lasting_error(s, visual.errors)) * to_centre);
  Eigen::Matrix<double, 6, 20> by_lasting;  // z₁, z₂, η
  static_assert(error_at::kVisionConstant == error_at::kVisionDrift + 6 &&
                error_at::kCalibration == error_at::kVisionDrift + 12);
  by_lasting << visual.errors.drift, visual.errors.drift, visual.errors.by_calibration;
  const Eigen::Matrix<double, 1, 6> along = adjoint(to_centre.inverse()).row(0);
  const Matrix6d seen_covariance =
      options_.vision.white_noise_factor * motion.own_covariance() +
      by_lasting * p.block<20, 20>(error_at::kVisionDrift, error_at::kVisionDrift) * by_lasting.transpose();
  const double seen_variance = along * seen_covariance * along.transpose();

  const auto square = [](double v) { return v * v; };
  const double weights = 1 / counted_variance + 1 / predicted_variance;
  const double mean_m = (counted_m / counted_variance + predicted.metres / predicted_variance) / weights;
  ForwardComparison result;
  result.imu_and_wheels_agree =
      square(counted_m - predicted.metres) <= square(kAgreeSigmas) * (counted_variance + predicted_variance);
  result.vision_contradicts_imu =
      square(seen_m - predicted.metres) > square(kAgreeSigmas) * (predicted_variance + seen_variance);
  result.vision_nis = square(seen_m - mean_m) / (1 / weights + seen_variance);
  return result;
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
  memory_.vision.wheels_in_prediction = false;
  memory_.vision.constant_velocity_noise.setZero();
  memory_.vision.constant_velocity_s = 0;
  clone_pose(memory_.estimate, error_at::kVisionClone);
}

}  // namespace spartan::internal
