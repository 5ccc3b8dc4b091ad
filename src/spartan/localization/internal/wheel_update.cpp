// Updates by wheel steps, slip estimation and zero-velocity updates.
#include <cmath>

#include "spartan/localization/internal/error_state_filter.h"
#include "spartan/localization/internal/kalman_update.h"
#include "spartan/localization/internal/measurement_models.h"

namespace spartan::internal {
namespace {

/// Shorter steps are not measured; steps longer than this many max_step_s have no meaningful mean attitude.
constexpr double kMinStep_s = 0.2, kMaxSteps = 4;
/// A step whose length is known with less than this ratio of the wheels' standard deviation updates their scale only:
/// slip is correlated over many steps, and its sum would otherwise be absorbed by the drift states of vision.
constexpr double kKnownRatio = 0.5;
/// Maximum age of the last wheel sample, and of the last frame, for the detection of a stationary rover.
constexpr double kFreshWheels_s = 0.5, kFreshFrame_s = 3;

}  // namespace

void ErrorStateFilter::update(const WheelSample& sample) {
  advance_to(sample.stamp);
  WheelMemory& wheels = memory_.wheels;
  const ZeroVelocityOptions& zero_velocity = options_.zero_velocity;
  if (!wheels.known || std::abs(sample.left_m - wheels.moved.left_m) > zero_velocity.wheels_stationary_m ||
      std::abs(sample.right_m - wheels.moved.right_m) > zero_velocity.wheels_stationary_m)
    wheels.moved = sample;
  wheels.previous = wheels.known ? wheels.last : sample;
  wheels.last = sample;
  wheels.known = true;
  if (still_stationary()) return;
  const double seconds = seconds_between(memory_.step.from, sample.stamp);
  if (memory_.step.has_wheels && seconds < options_.wheels.max_step_s) return;
  if (memory_.step.has_wheels && seconds <= kMaxSteps * options_.wheels.max_step_s) {
    update_by_step(sample);
    memory_.vision.wheels_in_prediction = true;
  }
  begin_step(sample);
}

/// Extrapolates the counts of the wheels to a time just after their last sample, at constant speed.
std::optional<WheelSample> ErrorStateFilter::wheels_at(Stamp stamp) const {
  const WheelMemory& w = memory_.wheels;
  if (!w.known) return std::nullopt;
  const double apart = seconds_between(w.previous.stamp, w.last.stamp), beyond = seconds_between(w.last.stamp, stamp);
  if (beyond > kFreshWheels_s || beyond > 1.5 * apart) return std::nullopt;
  const double part = apart > 0 ? beyond / apart : 0;
  return WheelSample{stamp, w.last.left_m + part * (w.last.left_m - w.previous.left_m),
                     w.last.right_m + part * (w.last.right_m - w.previous.right_m)};
}

/// Steps end with frames, so that vision and wheels measure the same motion.
void ErrorStateFilter::end_step_at_frame(Stamp stamp, bool vision_alone) {
  if (still_stationary()) return;
  const std::optional<WheelSample> wheels = wheels_at(stamp);
  const double seconds = seconds_between(memory_.step.from, stamp);
  // A step that began after the last frame adds nothing to a motion that vision alone has measured.
  const bool redundant = vision_alone && memory_.vision.wheels_in_prediction;
  if (wheels && !redundant && memory_.step.has_wheels && seconds >= kMinStep_s &&
      seconds <= kMaxSteps * options_.wheels.max_step_s)
    update_by_step(*wheels);
  begin_step(wheels);
}

WheelStep ErrorStateFilter::step_between(const WheelSample& from, const WheelSample& to) const {
  const WheelOdometryOptions& o = options_.wheels;
  const double left = to.left_m - from.left_m, right = to.right_m - from.right_m;
  WheelStep step;
  step.counted_m = 0.5 * (left + right);
  const double distance = std::abs(step.counted_m);
  step.forward_sigma_m = std::hypot(o.min_sigma_m, o.forward_sigma_ratio * distance);
  step.side_sigma_m = std::hypot(o.min_sigma_m, o.side_sigma_ratio * distance);
  step.up_sigma_m = std::hypot(o.min_sigma_m, o.up_sigma_ratio * distance);
  if (o.use_rotation && o.track_m > 0) {
    step.yaw_known = true;
    step.yaw_rad = (right - left) / o.track_m;
    step.yaw_sigma_rad =
        std::hypot(std::sqrt(2.0) * step.forward_sigma_m / o.track_m, o.turn_sigma_ratio * step.yaw_rad);
  }
  return step;
}

/// The length of the step is gated first: if it fails, the wheels slip and the whole step is rejected.
void ErrorStateFilter::update_by_step(const WheelSample& sample) {
  const WheelStep step = step_between(memory_.step.wheels, sample);
  const Innovation whole = wheel_innovation(memory_.estimate.state, step, wheel_centre_);
  Innovation forward(1);
  forward.residual[0] = whole.residual[0];
  forward.jacobian = whole.jacobian.topRows<1>();
  forward.noise(0, 0) = whole.noise(0, 0);
  const double length_nis = normalized_innovation_squared(memory_.estimate.covariance, forward);
  const bool slips = !(length_nis <= gates_.by_rows[1]);
  const double nis = slips ? length_nis : normalized_innovation_squared(memory_.estimate.covariance, whole);
  const int rows = slips ? 1 : whole.rows();
  if (accept(LocalizationSensor::wheels, nis, rows, slips ? HealthReason::slips : HealthReason::disagrees)) {
    const StepForward known = forward_since(memory_.estimate.state, error_at::kStepClone, wheel_centre_);
    const double variance = known.jacobian * memory_.estimate.covariance * known.jacobian.transpose();
    if (variance < std::pow(kKnownRatio * step.forward_sigma_m, 2)) {
      correct_only(memory_.estimate, forward, error_at::kWheelScale);
    } else if (memory_.vision.constant_velocity_s > 0) {
      correct_prediction(whole);
    } else {
      correct_motion(whole, error_at::kStepClone);
    }
  }
  estimate_slip(step);
}

/// Slip of the step that just ended, 1 − travelled / counted; an error of the wheel radius is part of it.
void ErrorStateFilter::estimate_slip(const WheelStep& step) {
  WheelMemory& wheels = memory_.wheels;
  wheels.slip_known = std::abs(step.counted_m) >= options_.wheels.min_slip_distance_m;
  if (!wheels.slip_known) return;
  const StepForward travelled = forward_since(memory_.estimate.state, error_at::kStepClone, wheel_centre_);
  const double variance = travelled.jacobian * memory_.estimate.covariance * travelled.jacobian.transpose();
  constexpr double kCount_m = 0.001;  // resolution of a count
  wheels.slip = 1 - travelled.metres / step.counted_m;
  wheels.slip_sigma =
      std::sqrt(std::max(variance, 0.0) + std::pow(kCount_m * (1 - wheels.slip), 2)) / std::abs(step.counted_m);
  wheels.slip_stamp = memory_.stamp;
}

void ErrorStateFilter::begin_step(const std::optional<WheelSample>& wheels) {
  StepMemory& step = memory_.step;
  step.from = memory_.stamp;
  step.odom_from_clone = memory_.world_from_odom.inverse() * memory_.estimate.state.world_from_body;
  step.has_wheels = wheels.has_value();
  if (wheels) step.wheels = *wheels;
  clone_pose(memory_.estimate, error_at::kStepClone);
}

bool ErrorStateFilter::wheels_stationary() const {
  const WheelMemory& wheels = memory_.wheels;
  return seconds_between(wheels.last.stamp, memory_.stamp) < kFreshWheels_s &&
         seconds_between(wheels.moved.stamp, memory_.stamp) >= options_.zero_velocity.wheels_stationary_s &&
         memory_.monitor(LocalizationSensor::wheels).state == SensorState::ok;
}

/// The IMU detects the end of a stop; without a usable IMU the rover does not count as stationary.
bool ErrorStateFilter::still_stationary() {
  bool& stationary = memory_.step.stationary;
  stationary = stationary && inertial_usable() &&
               seconds_between(memory_.imu.last.stamp, memory_.stamp) <= options_.imu.timeout_s;
  return stationary;
}

/// Zero-velocity update (ZUPT), called at the end of each block of IMU samples. A smooth drive looks stationary to an
/// IMU, and a rover may slide on stationary wheels; so two sensors and a chi-square test against the filter's own
/// motion are required. While the rover is stationary its pose is held at the pose where the stop began.
void ErrorStateFilter::update_zero_velocity(bool imu_stationary) {
  StepMemory& step = memory_.step;
  const bool wheels_reporting =
      memory_.wheels.known &&
      !memory_.monitor(LocalizationSensor::wheels).missing(memory_.stamp, options_.health.wheels_timeout_s);
  const bool vision_stationary =
      memory_.vision.stationary && seconds_between(memory_.vision.clone_stamp, memory_.stamp) < kFreshFrame_s;
  const bool stationary = options_.zero_velocity.enabled && imu_stationary && inertial_usable() &&
                          (wheels_reporting ? wheels_stationary() : vision_stationary);
  if (!stationary) {
    step.stationary = false;
    return;
  }
  if (!step.stationary) {
    begin_step(wheels_at(memory_.stamp));
    step.stationary = true;
    return;
  }
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal().head<3>().setConstant(std::pow(options_.zero_velocity.position_sigma_m, 2));
  covariance.diagonal().tail<3>().setConstant(std::pow(options_.zero_velocity.attitude_sigma_rad, 2));
  const Innovation innovation =
      relative_motion_innovation(memory_.estimate.state, error_at::kStepClone, Pose(), covariance, {});
  if (normalized_innovation_squared(memory_.estimate.covariance, innovation) > gates_.by_rows[6]) {
    begin_step(wheels_at(memory_.stamp));
    return;
  }
  correct_motion(innovation, error_at::kStepClone);
}

}  // namespace spartan::internal
