#include "spartan/localization/internal/updates/state_propagation.h"

#include <algorithm>
#include <cmath>

#include "spartan/localization/internal/propagation.h"

namespace spartan::internal {
namespace {

/// Random walk of the clock of the IMU: 20 ppm are 2 ms in 100 s.
constexpr double kClockWalk_s_sqrt_s = 2e-4;
/// Longest step of the constant-velocity model: beyond it the covariance stops growing.
constexpr double kMaxStep_s = 60;

}  // namespace

StatePropagation::StatePropagation(const LocalizationOptions& options)
    : gravity_m_s2_(options.gravity_m_s2),
      imu_(options.imu),
      constant_velocity_(options.constant_velocity),
      wheel_scale_sigma_(options.wheels.scale_sigma),
      wheel_scale_walk_(options.wheels.scale_walk_per_sqrt_s),
      compass_offset_walk_(options.compass.offset_walk_rad_per_sqrt_s),
      inclinometer_bias_walk_(options.inclinometer.bias_walk_rad_per_sqrt_s) {}

void StatePropagation::propagate_to(FilterMemory& memory, Stamp stamp, const ImuSample* next) const {
  const double seconds = seconds_between(memory.stamp, stamp);
  if (!(seconds > 0)) return;
  const ImuSample& last = memory.imu.last;
  if (memory.inertial_usable() && seconds_between(last.stamp, stamp) <= imu_.timeout_s) {
    if (next != nullptr) {
      propagate_inertially(memory, seconds, interpolate(last, *next, memory.stamp), interpolate(last, *next, stamp));
    } else {
      propagate_inertially(memory, seconds, last, last);
    }
  } else {
    propagate_at_constant_velocity(memory, std::min(seconds, kMaxStep_s));
  }
  propagate_biases(memory.estimate.covariance, seconds);
  memory.stamp = stamp;
}

void StatePropagation::propagate_inertially(FilterMemory& memory, double seconds, const ImuSample& from,
                                            const ImuSample& to) const {
  const InertialStep step{from.gyro_rad_s, to.gyro_rad_s, from.accel_m_s2, to.accel_m_s2, seconds};
  const InertialNoise noise = inertial_noise(imu_, memory.imu.noise);
  propagate_covariance(memory.estimate, transition(memory.estimate.state, step, noise, gravity_m_s2_));
  memory.estimate.state = propagate(memory.estimate.state, step, gravity_m_s2_);
}

void StatePropagation::propagate_at_constant_velocity(FilterMemory& memory, double seconds) const {
  const ConstantVelocityOptions& o = constant_velocity_;
  VisionMemory& vision = memory.vision;
  const ConstantVelocityStep step{vision.rate_rad_s, seconds};
  const double speed = memory.estimate.state.velocity_m_s.norm(), rate = vision.rate_rad_s.norm();
  // The angular rate of a rocking rover changes slowly, so that the attitude error grows as σ t;
  // (t + dt)² − t² = (2 t + dt) dt.
  const double rotation =
      o.rate_sigma_ratio * (rate + o.rate_offset_rad_s) * std::sqrt(2 * vision.constant_velocity_s + seconds);
  const ConstantVelocityNoise noise{o.speed_sigma_ratio_per_sqrt_s * (speed + o.speed_offset_m_s), rotation};
  const Transition t = transition(memory.estimate.state, step, noise);
  const Matrix9d by = t.by_moving.topLeftCorner<9, 9>();
  vision.constant_velocity_noise =
      (by * vision.constant_velocity_noise * by.transpose()).eval() + t.noise.topLeftCorner<9, 9>();
  vision.constant_velocity_s += seconds;
  propagate_covariance(memory.estimate, t);
  memory.estimate.state = propagate(memory.estimate.state, step);
}

void StatePropagation::propagate_biases(ErrorCovariance& p, double seconds) const {
  const auto square = [](double x) { return x * x; };
  if (p(error_at::kImuTime, error_at::kImuTime) < square(imu_.time_offset_sigma_s))
    p(error_at::kImuTime, error_at::kImuTime) += square(kClockWalk_s_sqrt_s) * seconds;
  if (p(error_at::kWheelScale, error_at::kWheelScale) < square(wheel_scale_sigma_))
    p(error_at::kWheelScale, error_at::kWheelScale) += square(wheel_scale_walk_) * seconds;
  p(error_at::kCompassOffset, error_at::kCompassOffset) += square(compass_offset_walk_) * seconds;
  p.diagonal().segment<2>(error_at::kInclinometerBias).array() += square(inclinometer_bias_walk_) * seconds;
}

}  // namespace spartan::internal
