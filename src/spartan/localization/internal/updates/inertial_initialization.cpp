#include "spartan/localization/internal/updates/inertial_initialization.h"

#include <algorithm>
#include <cmath>

#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/internal/updates/filter_correction.h"

namespace spartan::internal {
namespace {

/// Standard deviation of a rover's mean acceleration while its IMU is levelled.
constexpr double kLevelError_m_s2 = 0.1;
/// The IMU is used once its biases and the vertical are known this well: errors beyond are not linear any more.
constexpr double kAlignedGyroBias_rad_s = 0.01, kAlignedUp_rad = 0.2;
/// Standard deviations of the biases of an IMU that was excluded, where less is specified.
constexpr double kChangedGyroBias_rad_s = 0.05, kChangedAccelBias_m_s2 = 0.3;
/// An IMU that cannot be aligned for this long is suspect.
constexpr double kSlowAlignment_s = 10;

/// Velocity, biases and clock, in the order of the state, of the 13 unknowns of an alignment.
constexpr int kTaken = 10;
Eigen::Array<int, kTaken, 1> taken_errors() {
  static_assert(error_at::kGyroBias == error_at::kVelocity + 3 && error_at::kAccelBias == error_at::kVelocity + 6);
  Eigen::Array<int, kTaken, 1> at;
  at << Eigen::Array<int, 9, 1>::LinSpaced(error_at::kVelocity, error_at::kVelocity + 8), error_at::kImuTime;
  return at;
}
Eigen::Matrix<double, kTaken, 13> taken_unknowns() {
  Eigen::Matrix<double, kTaken, 13> selection = Eigen::Matrix<double, kTaken, 13>::Zero();
  selection.block<3, 3>(0, 6).setIdentity();
  selection.block<6, 6>(3, 0).setIdentity();
  selection(9, 12) = 1;
  return selection;
}

}  // namespace

void InertialInitialization::add(FilterMemory& memory, const ImuSample& sample) const {
  search_alignment(memory, sample);
  if (!memory.gravity_known) level(memory, sample);
}

void InertialInitialization::search_alignment(FilterMemory& memory, const ImuSample& sample) const {
  InertialMemory& imu = memory.imu;
  SensorMonitor& monitor = memory.monitor(LocalizationSensor::imu);
  const bool frozen_or_broken = monitor.state == SensorState::excluded && monitor.reason != HealthReason::contradicted;
  if (!imu.window.add(imu.last, sample, inertial_noise(options_, imu.noise), options_.timeout_s)) return;
  const bool enough = imu.window.is_full() || imu.window.seconds() >= options_.alignment_s;
  const auto alignment = frozen_or_broken || !enough ? std::nullopt : imu.window.align(prior(memory));
  if (alignment) {
    const auto sigma = [&](int at) { return std::sqrt(alignment->covariance.diagonal().segment<3>(at).maxCoeff()); };
    if (sigma(0) <= kAlignedGyroBias_rad_s && (memory.gravity_known || sigma(9) <= kAlignedUp_rad)) {
      take_over(memory, *alignment);
      return;
    }
  }
  if (monitor.state == SensorState::ok && seconds_between(imu.waiting_since, sample.stamp) > kSlowAlignment_s) {
    monitor.state = SensorState::suspect;
    monitor.reason = HealthReason::not_aligned;
  }
}

/// The vertical counts little, because it is corrected by what is found; it makes a single motion enough. Of an IMU
/// that was contradicted the biases may have changed by any amount.
AlignmentPrior InertialInitialization::prior(const FilterMemory& memory) const {
  constexpr double kUpFactor = 3;
  const bool changed = memory.monitor(LocalizationSensor::imu).state == SensorState::excluded;
  AlignmentPrior prior{std::max(options_.gyro_bias_sigma_rad_s, changed ? kChangedGyroBias_rad_s : 0),
                       std::max(options_.accel_bias_sigma_m_s2, changed ? kChangedAccelBias_m_s2 : 0),
                       gravity_m_s2_,
                       std::sqrt(memory.estimate.covariance(error_at::kImuTime, error_at::kImuTime)),
                       std::nullopt,
                       0};
  if (!memory.gravity_known) return prior;
  const UpInBody up = up_in_body(memory.estimate.state, error_at::kVisionClone);
  const Eigen::Matrix3d covariance = up.jacobian * memory.estimate.covariance * up.jacobian.transpose();
  prior.up = up.up;
  prior.up_sigma_rad = kUpFactor * std::sqrt(covariance.trace());
  return prior;
}

/// The vertical at once, whatever the slope: the mean specific force points up, but for the rover's accelerations.
void InertialInitialization::level(FilterMemory& memory, const ImuSample& sample) const {
  InertialMemory& imu = memory.imu;
  NavigationState& s = memory.estimate.state;
  imu.level_force_sum += s.world_from_body.rotation() * sample.accel_m_s2;
  ++imu.level_count;
  if (seconds_between(imu.level_from, sample.stamp) < options_.alignment_s) return;
  const Eigen::Vector3d mean = imu.level_force_sum / imu.level_count;
  imu.level_from = sample.stamp;
  imu.level_force_sum.setZero();
  imu.level_count = 0;
  if (std::abs(mean.norm() - gravity_m_s2_) > 0.05 * gravity_m_s2_) return;
  s.gravity_tilt_rad = tilt_of_up(mean);
  correct_world(memory,
                rest_innovation(s, s.world_from_body.rotation().conjugate() * mean, kLevelError_m_s2, gravity_m_s2_));
  memory.gravity_known = true;
}

void take_over(FilterMemory& memory, const InertialAlignment& a) {
  NavigationState& s = memory.estimate.state;
  ErrorCovariance& p = memory.estimate.covariance;
  s.velocity_m_s = a.velocity_m_s;
  s.gyro_bias_rad_s = a.gyro_bias_rad_s;
  s.accel_bias_m_s2 = a.accel_bias_m_s2;
  if (!memory.gravity_known) s.gravity_tilt_rad = tilt_of_up(s.world_from_vision_clone.rotation() * a.up);
  s.imu_time_offset_s += a.time_offset_s;

  const auto at = taken_errors();
  const auto selection = taken_unknowns();
  p(at, Eigen::all).setZero();
  p(Eigen::all, at).setZero();
  if (memory.estimate.past) memory.estimate.past->with_present(Eigen::all, at).setZero();
  p(at, at) = selection * a.covariance * selection.transpose();

  const Eigen::Vector3d side = a.up.unitOrthogonal();
  Eigen::Matrix<double, 2, 3> directions;
  directions << side.transpose(), a.up.cross(side).transpose();
  const UpInBody up = up_in_body(s, error_at::kVisionClone);
  Innovation innovation(2);
  innovation.residual = directions * (a.up - up.up);
  innovation.jacobian = directions * up.jacobian;
  innovation.noise = directions * a.covariance.block<3, 3>(9, 9) * directions.transpose();
  innovation.noise.diagonal().array() += 1e-10;
  innovation.shared = Eigen::Matrix<double, error_at::kSize, 2>::Zero();
  innovation.shared(at, Eigen::all) = -selection * a.covariance.middleCols<3>(9) * directions.transpose();
  correct_world(memory, innovation);
  memory.imu.aligned = memory.gravity_known = true;
  memory.imu.window = {};
  memory.monitor(LocalizationSensor::imu).readmit();
}

}  // namespace spartan::internal
