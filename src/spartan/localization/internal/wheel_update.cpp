// Steps of the wheels, slip, and standing.
#include <cmath>

#include "spartan/localization/internal/error_state_filter.h"
#include "spartan/localization/internal/kalman_update.h"
#include "spartan/localization/internal/measurement_models.h"

namespace spartan {
namespace {

/// Shorter steps are not worth a measurement; over much longer ones a mean attitude says nothing.
constexpr double kShortestStep_s = 0.2, kLongestSteps = 4;
/// A step whose length is known so much better than the wheels can tell only teaches their scale: slip stays the same
/// over many steps, and its sum would otherwise pass for an error of vision that lasts.
constexpr double kKnownWell = 0.5;
/// How old the last sign of the wheels, or of vision, may be to say that the rover stands.
constexpr double kFreshWheels_s = 0.5, kFreshShot_s = 3;

}  // namespace

void ErrorStateFilter::take(const WheelSample& sample) {
  move_to(sample.stamp, nullptr);
  WheelMemory& wheels = memory_.wheels;
  const StandingStillOptions& still = options_.standing;
  if (!wheels.known || std::abs(sample.left_m - wheels.moved.left_m) > still.wheels_still_m ||
      std::abs(sample.right_m - wheels.moved.right_m) > still.wheels_still_m)
    wheels.moved = sample;
  wheels.previous = wheels.known ? wheels.last : sample;
  wheels.last = sample;
  wheels.known = true;
  if (still_stands()) return;
  const double seconds = seconds_between(memory_.step.from, sample.stamp);
  if (memory_.step.has_wheels && seconds < options_.wheels.longest_step_s) return;
  if (memory_.step.has_wheels && seconds <= kLongestSteps * options_.wheels.longest_step_s) measure_step(sample);
  begin_step(sample);
}

/// What the wheels count at a moment just behind their last sample: they go on turning as they did.
std::optional<WheelSample> ErrorStateFilter::wheels_at(Stamp stamp) const {
  const WheelMemory& w = memory_.wheels;
  if (!w.known) return std::nullopt;
  const double apart = seconds_between(w.previous.stamp, w.last.stamp), beyond = seconds_between(w.last.stamp, stamp);
  if (beyond > kFreshWheels_s || beyond > 1.5 * apart) return std::nullopt;
  const double part = apart > 0 ? beyond / apart : 0;
  return WheelSample{stamp, w.last.left_m + part * (w.last.left_m - w.previous.left_m),
                     w.last.right_m + part * (w.last.right_m - w.previous.right_m)};
}

/// Steps end with shots, so that vision and wheels speak of the same motion.
void ErrorStateFilter::end_step_at_shot(Stamp stamp) {
  if (still_stands()) return;
  const std::optional<WheelSample> wheels = wheels_at(stamp);
  const double seconds = seconds_between(memory_.step.from, stamp);
  if (wheels && memory_.step.has_wheels && seconds >= kShortestStep_s &&
      seconds <= kLongestSteps * options_.wheels.longest_step_s)
    measure_step(*wheels);
  begin_step(wheels);
}

WheelStep ErrorStateFilter::step_to(const WheelSample& sample) const {
  const WheelOdometryOptions& o = options_.wheels;
  const double left = sample.left_m - memory_.step.wheels.left_m, right = sample.right_m - memory_.step.wheels.right_m;
  WheelStep step;
  step.counted_m = 0.5 * (left + right);
  const double distance = std::abs(step.counted_m);
  step.forward_sigma_m = std::hypot(o.floor_m, o.forward_share * distance);
  step.side_sigma_m = std::hypot(o.floor_m, o.side_share * distance);
  step.up_sigma_m = std::hypot(o.floor_m, o.up_share * distance);
  if (o.track_m > 0) {
    step.turn_known = true;
    step.turn_rad = (right - left) / o.track_m;
    step.turn_sigma_rad = std::hypot(std::sqrt(2.0) * step.forward_sigma_m / o.track_m, o.turn_share * step.turn_rad);
  }
  return step;
}

/// The step's length is judged first: where it is wrong the wheels slip, and nothing of the step counts.
void ErrorStateFilter::measure_step(const WheelSample& sample) {
  const WheelStep step = step_to(sample);
  const Innovation whole = wheel_innovation(memory_.belief.state, step);
  Innovation forward(1);
  forward.residual[0] = whole.residual[0];
  forward.jacobian = whole.jacobian.topRows<1>();
  forward.noise(0, 0) = whole.noise(0, 0);
  const double length_square = normalised_square(memory_.belief.covariance, forward);
  const bool slips = !(length_square <= gates_[1]);
  const double square = slips ? length_square : normalised_square(memory_.belief.covariance, whole);
  const int rows = slips ? 1 : whole.rows();
  if (judge(LocalizationSensor::wheels, square, rows, slips ? HealthReason::slips : HealthReason::disagrees)) {
    const StepForward known = forward_of_step(memory_.belief.state);
    const double variance = known.jacobian * memory_.belief.covariance * known.jacobian.transpose();
    if (variance < std::pow(kKnownWell * step.forward_sigma_m, 2)) {
      correct_only(memory_.belief, forward, error_at::kWheelScale);
    } else {
      correct_motion(whole, error_at::kStepClone);
    }
  }
  state_slip(step);
}

/// 1 − travelled / counted, of the step that just ended. The count's radius is part of it.
void ErrorStateFilter::state_slip(const WheelStep& step) {
  WheelMemory& wheels = memory_.wheels;
  wheels.slip_known = std::abs(step.counted_m) >= options_.wheels.least_slip_distance_m;
  if (!wheels.slip_known) return;
  const StepForward travelled = forward_of_step(memory_.belief.state);
  const double variance = travelled.jacobian * memory_.belief.covariance * travelled.jacobian.transpose();
  constexpr double kCount_m = 0.001;  // what a count is rounded by
  wheels.slip = 1 - travelled.metres / step.counted_m;
  wheels.slip_sigma =
      std::sqrt(std::max(variance, 0.0) + std::pow(kCount_m * (1 - wheels.slip), 2)) / std::abs(step.counted_m);
  wheels.slip_stamp = memory_.stamp;
}

void ErrorStateFilter::begin_step(const std::optional<WheelSample>& wheels) {
  StepMemory& step = memory_.step;
  step.from = memory_.stamp;
  step.odom_from_clone = memory_.world_from_odom.inverse() * memory_.belief.state.world_from_body;
  step.has_wheels = wheels.has_value();
  if (wheels) step.wheels = *wheels;
  clone_pose(memory_.belief, error_at::kStepClone);
}

bool ErrorStateFilter::wheels_stand() const {
  const WheelMemory& wheels = memory_.wheels;
  return seconds_between(wheels.last.stamp, memory_.stamp) < kFreshWheels_s &&
         seconds_between(wheels.moved.stamp, memory_.stamp) >= options_.standing.wheels_still_s &&
         memory_.judge(LocalizationSensor::wheels).state == SensorState::ok;
}

/// It is the IMU that says when standing ends; of one that has gone silent, or is not believed, nothing is known.
bool ErrorStateFilter::still_stands() {
  bool& standing = memory_.step.standing;
  standing =
      standing && inertial_usable() && seconds_between(memory_.imu.last.stamp, memory_.stamp) <= options_.imu.timeout_s;
  return standing;
}

/// Asked at the end of each block of IMU samples. A smooth ride looks like standing to an IMU, and a rover may slide on
/// wheels that stand; so two witnesses are needed, and the test against the filter's own motion. While the rover stands
/// its pose is held at the one where standing began.
void ErrorStateFilter::hold_still(bool imu_still) {
  StepMemory& step = memory_.step;
  const bool wheels_speak =
      memory_.wheels.known &&
      !memory_.judge(LocalizationSensor::wheels).missing(memory_.stamp, options_.health.wheels_timeout_s);
  const bool shot_says_so =
      memory_.vision.stood && seconds_between(memory_.vision.clone_stamp, memory_.stamp) < kFreshShot_s;
  const bool stands =
      options_.standing.enabled && imu_still && inertial_usable() && (wheels_speak ? wheels_stand() : shot_says_so);
  if (!stands) {
    step.standing = false;
    return;
  }
  if (!step.standing) {
    begin_step(wheels_at(memory_.stamp));
    step.standing = true;
    return;
  }
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal().head<3>().setConstant(std::pow(options_.standing.position_m, 2));
  covariance.diagonal().tail<3>().setConstant(std::pow(options_.standing.attitude_rad, 2));
  const Innovation innovation =
      relative_motion_innovation(memory_.belief.state, error_at::kStepClone, Pose(), covariance, Vector6d::Zero());
  if (normalised_square(memory_.belief.covariance, innovation) > gates_[6]) {
    begin_step(wheels_at(memory_.stamp));
    return;
  }
  correct_motion(innovation, error_at::kStepClone);
}

}  // namespace spartan
