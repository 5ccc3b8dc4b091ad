#include "spartan/localization/internal/updates/zero_velocity_update.h"

#include <cmath>

#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/internal/updates/filter_correction.h"
#include "spartan/localization/internal/updates/wheel_step.h"

namespace spartan::internal {
namespace {

/// Maximum age of the last frame.
constexpr double kFreshFrame_s = 3;

double scatter(const Eigen::Vector3d& squares, const Eigen::Vector3d& sum, double count) {
  return std::sqrt((squares / count - (sum / count).cwiseAbs2()).cwiseMax(0).maxCoeff());
}

}  // namespace

ZeroVelocityUpdate::ZeroVelocityUpdate(const LocalizationOptions& options)
    : options_(options.zero_velocity),
      imu_(options.imu),
      wheels_timeout_s_(options.health.wheels_timeout_s),
      gates_(options) {}

void ZeroVelocityUpdate::add(FilterMemory& memory, const ImuSample& sample) const {
  StationaryBlock& b = memory.imu.block;
  b.gyro += sample.gyro_rad_s;
  b.accel += sample.accel_m_s2;
  b.gyro_squares += sample.gyro_rad_s.cwiseAbs2();
  b.accel_squares += sample.accel_m_s2.cwiseAbs2();
  ++b.count;
  if (seconds_between(b.from, sample.stamp) < options_.block_s) return;
  const bool stationary = imu_stationary(memory, sample);
  b = {};
  b.from = sample.stamp;
  update(memory, stationary);
}

bool ZeroVelocityUpdate::imu_stationary(const FilterMemory& memory, const ImuSample& sample) const {
  const StationaryBlock& b = memory.imu.block;
  const Eigen::Vector3d rate = b.gyro / b.count - memory.estimate.state.gyro_bias_rad_s;
  const double interval = seconds_between(b.from, sample.stamp) / b.count;
  const double bias_sigma = std::sqrt(memory.estimate.covariance.diagonal().segment<3>(error_at::kGyroBias).maxCoeff());
  return b.count >= 3 && scatter(b.gyro_squares, b.gyro, b.count) < imu_.stationary_gyro(interval) &&
         scatter(b.accel_squares, b.accel, b.count) < imu_.stationary_accel(interval) &&
         rate.norm() < imu_.stationary_gyro_rad_s + 3 * bias_sigma;
}

bool ZeroVelocityUpdate::wheels_stationary(const FilterMemory& memory) const {
  const WheelMemory& wheels = memory.wheels;
  return seconds_between(wheels.last.stamp, memory.stamp) < kFreshWheels_s &&
         seconds_between(wheels.moved.stamp, memory.stamp) >= options_.wheels_stationary_s &&
         memory.monitor(LocalizationSensor::wheels).state == SensorState::ok;
}

void ZeroVelocityUpdate::update(FilterMemory& memory, bool imu_stationary) const {
  StepMemory& step = memory.step;
  const bool wheels_reporting =
      memory.wheels.known && !memory.monitor(LocalizationSensor::wheels).missing(memory.stamp, wheels_timeout_s_);
  const bool vision_stationary =
      memory.vision.stationary && seconds_between(memory.vision.clone_stamp, memory.stamp) < kFreshFrame_s;
  const bool stationary = options_.enabled && imu_stationary && memory.inertial_usable() &&
                          (wheels_reporting ? wheels_stationary(memory) : vision_stationary);
  if (!stationary) {
    step.stationary = false;
    return;
  }
  if (!step.stationary) {
    begin_step(memory, wheels_at(memory.wheels, memory.stamp));
    step.stationary = true;
    return;
  }
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal().head<3>().setConstant(std::pow(options_.position_sigma_m, 2));
  covariance.diagonal().tail<3>().setConstant(std::pow(options_.attitude_sigma_rad, 2));
  const Innovation innovation =
      relative_motion_innovation(memory.estimate.state, error_at::kStepClone, Pose(), covariance, {});
  if (normalized_innovation_squared(memory.estimate.covariance, innovation) > gates_.limit(6)) {
    begin_step(memory, wheels_at(memory.wheels, memory.stamp));
    return;
  }
  correct_motion(memory, innovation, error_at::kStepClone);
}

}  // namespace spartan::internal
