#include "spartan/localization/internal/updates/wheel_update.h"

#include <algorithm>
#include <cmath>

#include "spartan/localization/internal/updates/filter_correction.h"
#include "spartan/localization/internal/updates/wheel_step.h"

namespace spartan::internal {
namespace {

/// Steps longer than this many max_step_s have no meaningful mean attitude.
constexpr double kMaxSteps = 4;
/// A step goes on over frames while it is shorter than kMinStep_s, or shorter than kSlowStep_s and kMinStep_m: the
/// error of a step is independent of those before it, which many short ones are not.
constexpr double kMinStep_s = 0.2, kSlowStep_s = 1, kMinStep_m = 0.05;
/// A step whose length is known with less than this ratio of the wheels' standard deviation updates their scale only:
/// slip is correlated over many steps, and its sum would otherwise be absorbed by the drift states of vision.
constexpr double kKnownRatio = 0.5;

bool is_short(const WheelSample& from, const WheelSample& to, double seconds) {
  const double distance = std::max(std::abs(to.left_m - from.left_m), std::abs(to.right_m - from.right_m));
  return seconds < kMinStep_s || (seconds < kSlowStep_s && distance < kMinStep_m);
}

}  // namespace

WheelUpdate::WheelUpdate(const LocalizationOptions& options)
    : options_(options.wheels),
      stationary_m_(options.zero_velocity.wheels_stationary_m),
      imu_timeout_s_(options.imu.timeout_s),
      centre_(turning_centre(options)),
      gates_(options) {}

void WheelUpdate::update(FilterMemory& memory, const WheelSample& sample) const {
  WheelMemory& wheels = memory.wheels;
  if (!wheels.known || std::abs(sample.left_m - wheels.moved.left_m) > stationary_m_ ||
      std::abs(sample.right_m - wheels.moved.right_m) > stationary_m_)
    wheels.moved = sample;
  wheels.previous = wheels.known ? wheels.last : sample;
  wheels.last = sample;
  wheels.known = true;
  if (still_stationary(memory, imu_timeout_s_)) return;
  const double seconds = seconds_between(memory.step.from, sample.stamp);
  if (memory.step.has_wheels && seconds < options_.max_step_s) return;
  if (memory.step.has_wheels && seconds <= kMaxSteps * options_.max_step_s) {
    update_by_step(memory, sample);
    memory.vision.wheels_in_prediction = true;
  }
  begin_step(memory, sample);
}

void WheelUpdate::end_step_at_frame(FilterMemory& memory, Stamp stamp, bool vision_alone) const {
  if (still_stationary(memory, imu_timeout_s_)) return;
  const std::optional<WheelSample> wheels = wheels_at(memory.wheels, stamp);
  const double seconds = seconds_between(memory.step.from, stamp);
  // A step that began after the last frame adds nothing to a motion that vision alone has measured.
  const bool redundant = vision_alone && memory.vision.wheels_in_prediction;
  if (wheels && !redundant && memory.step.has_wheels) {
    if (is_short(memory.step.wheels, *wheels, seconds)) return;
    if (seconds <= kMaxSteps * options_.max_step_s) update_by_step(memory, *wheels);
  }
  begin_step(memory, wheels);
}

/// The length of the step is gated first: if it fails, the wheels slip and the whole step is rejected.
void WheelUpdate::update_by_step(FilterMemory& memory, const WheelSample& sample) const {
  const WheelStep step = step_between(memory.step.wheels, sample, options_);
  const Innovation whole = wheel_innovation(memory.estimate.state, step, centre_);
  Innovation forward(1);
  forward.residual[0] = whole.residual[0];
  forward.jacobian = whole.jacobian.topRows<1>();
  forward.noise(0, 0) = whole.noise(0, 0);
  const double length_nis = normalized_innovation_squared(memory.estimate.covariance, forward);
  const bool slips = !(length_nis <= gates_.limit(1));
  const double nis = slips ? length_nis : normalized_innovation_squared(memory.estimate.covariance, whole);
  const int rows = slips ? 1 : whole.rows();
  if (gates_.accept(memory, LocalizationSensor::wheels, nis, rows,
                    slips ? HealthReason::slips : HealthReason::disagrees)) {
    const StepForward known = forward_since(memory.estimate.state, error_at::kStepClone, centre_);
    const double variance = known.jacobian * memory.estimate.covariance * known.jacobian.transpose();
    if (variance < std::pow(kKnownRatio * step.forward_sigma_m, 2)) {
      correct_only(memory.estimate, forward, error_at::kWheelScale);
    } else if (memory.vision.constant_velocity_s > 0) {
      correct_prediction(memory, whole);
    } else {
      correct_motion(memory, whole, error_at::kStepClone);
    }
  }
  estimate_slip(memory, step);
}

/// Slip of the step that just ended, 1 − travelled / counted; an error of the wheel radius is part of it.
void WheelUpdate::estimate_slip(FilterMemory& memory, const WheelStep& step) const {
  WheelMemory& wheels = memory.wheels;
  wheels.slip_known = std::abs(step.counted_m) >= options_.min_slip_distance_m;
  if (!wheels.slip_known) return;
  const StepForward travelled = forward_since(memory.estimate.state, error_at::kStepClone, centre_);
  const double variance = travelled.jacobian * memory.estimate.covariance * travelled.jacobian.transpose();
  constexpr double kCount_m = 0.001;  // resolution of a count
  wheels.slip = 1 - travelled.metres / step.counted_m;
  wheels.slip_sigma =
      std::sqrt(std::max(variance, 0.0) + std::pow(kCount_m * (1 - wheels.slip), 2)) / std::abs(step.counted_m);
  wheels.slip_stamp = memory.stamp;
}

}  // namespace spartan::internal
