// IMU samples: checks, levelling, alignment and the detection of a stationary rover.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "spartan/localization/internal/error_state_filter.h"
#include "spartan/localization/internal/measurement_models.h"

namespace spartan::internal {
namespace {

/// Physical range of IMU readings of a rover: about 2000 °/s and 30 g; empirical.
constexpr double kMaxRate_rad_s = 35, kMaxForce_m_s2 = 300;
/// Standard deviation of a rover's mean acceleration while its IMU is levelled.
constexpr double kLevelError_m_s2 = 0.1;
/// The IMU is used once its biases and the vertical are known this well: errors beyond are not linear any more.
constexpr double kAlignedGyroBias_rad_s = 0.01, kAlignedUp_rad = 0.2;
/// Standard deviations of the biases of an IMU that was excluded, where less is specified.
constexpr double kChangedGyroBias_rad_s = 0.05, kChangedAccelBias_m_s2 = 0.3;
/// An IMU that cannot be aligned for this long is suspect.
constexpr double kSlowAlignment_s = 10;

}  // namespace

bool is_possible(const ImuSample& sample) {
  return sample.gyro_rad_s.cwiseAbs().maxCoeff() < kMaxRate_rad_s &&
         sample.accel_m_s2.cwiseAbs().maxCoeff() < kMaxForce_m_s2;
}

void ErrorStateFilter::update(const ImuSample& by_own_clock) {
  ImuQueue& waiting = memory_.imu.waiting;
  if (waiting.full()) use_waiting_until(at_frame_time(waiting.front()).stamp);
  waiting.push(by_own_clock);
  Stamp reached = by_own_clock.stamp;
  reached.ns -= std::llround(options_.imu.max_time_error_s() * 1e9);
  use_waiting_until(reached);
}

/// Uses the readings that were taken up to that time.
void ErrorStateFilter::use_waiting_until(Stamp stamp) {
  ImuQueue& waiting = memory_.imu.waiting;
  while (!waiting.empty()) {
    const ImuSample sample = at_frame_time(waiting.front());
    if (sample.stamp > stamp) return;
    waiting.pop();
    use(sample);
  }
}

/// With the stamp by the clock of the cameras, as far as it is known; not before the present.
ImuSample ErrorStateFilter::at_frame_time(const ImuSample& by_own_clock) const {
  const double limit = options_.imu.max_time_error_s();
  const double offset_s = std::clamp(memory_.estimate.state.imu_time_offset_s, -limit, limit);
  ImuSample sample = by_own_clock;
  sample.stamp.ns -= std::llround(offset_s * 1e9);
  if (limit > 0) sample.stamp = std::max(sample.stamp, memory_.stamp);
  return sample;
}

void ErrorStateFilter::use(const ImuSample& sample) {
  check_reading(sample);
  InertialMemory& imu = memory_.imu;
  if (imu.known) {
    imu.noise.add(imu.last, sample);
    if (!inertial_usable()) {
      search_alignment(sample);
      if (!memory_.gravity_known) level(sample);
    }
  }
  propagate_to(sample.stamp, &sample);
  if (inertial_usable()) ++memory_.monitor(LocalizationSensor::imu).used;
  if (!imu.known) {
    imu.known = true;
    imu.changed = imu.block.from = imu.level_from = imu.waiting_since = sample.stamp;
  }
  imu.last = sample;
  detect_stationary(sample);
}

/// Readings beyond the physical range of a rover, and frozen ones, exclude the IMU; others readmit it.
void ErrorStateFilter::check_reading(const ImuSample& sample) {
  SensorMonitor& monitor = memory_.monitor(LocalizationSensor::imu);
  InertialMemory& imu = memory_.imu;
  const bool same = imu.known && imu.last.gyro_rad_s == sample.gyro_rad_s && imu.last.accel_m_s2 == sample.accel_m_s2;
  if (!same) imu.changed = sample.stamp;
  const bool possible = is_possible(sample);
  const bool frozen = same && seconds_between(imu.changed, sample.stamp) >= options_.imu.frozen_s;
  if (!possible || frozen) {
    ++monitor.rejected;
    monitor.exclude(possible ? HealthReason::frozen : HealthReason::out_of_range);
  } else if (monitor.state == SensorState::excluded && monitor.reason != HealthReason::contradicted && !same) {
    if (++monitor.passed_in_row >= options_.health.readmit_after) monitor.readmit();
  }
}

/// The vertical at once, whatever the slope: the mean specific force points up, but for the rover's accelerations.
void ErrorStateFilter::level(const ImuSample& sample) {
  InertialMemory& imu = memory_.imu;
  NavigationState& s = memory_.estimate.state;
  imu.level_force_sum += s.world_from_body.rotation() * sample.accel_m_s2;
  ++imu.level_count;
  if (seconds_between(imu.level_from, sample.stamp) < options_.imu.alignment_s) return;
  const Eigen::Vector3d mean = imu.level_force_sum / imu.level_count;
  imu.level_from = sample.stamp;
  imu.level_force_sum.setZero();
  imu.level_count = 0;
  if (std::abs(mean.norm() - options_.gravity_m_s2) > 0.05 * options_.gravity_m_s2) return;
  s.gravity_tilt_rad = tilt_of_up(mean);
  correct_world(
      rest_innovation(s, s.world_from_body.rotation().conjugate() * mean, kLevelError_m_s2, options_.gravity_m_s2));
  memory_.gravity_known = true;
}

/// Alignment of an IMU that is not in use, by the visual motions of the last frames.
void ErrorStateFilter::search_alignment(const ImuSample& sample) {
  InertialMemory& imu = memory_.imu;
  SensorMonitor& monitor = memory_.monitor(LocalizationSensor::imu);
  const bool frozen_or_broken = monitor.state == SensorState::excluded && monitor.reason != HealthReason::contradicted;
  if (!imu.window.add(imu.last, sample, inertial_noise(options_.imu, imu.noise), options_.imu.timeout_s)) return;
  const bool enough = imu.window.is_full() || imu.window.seconds() >= options_.imu.alignment_s;
  const auto alignment = frozen_or_broken || !enough ? std::nullopt : imu.window.align(alignment_prior());
  if (alignment) {
    const auto sigma = [&](int at) { return std::sqrt(alignment->covariance.diagonal().segment<3>(at).maxCoeff()); };
    if (sigma(0) <= kAlignedGyroBias_rad_s && (memory_.gravity_known || sigma(9) <= kAlignedUp_rad)) {
      align(*alignment);
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
AlignmentPrior ErrorStateFilter::alignment_prior() const {
  constexpr double kUpFactor = 3;
  const bool changed = memory_.monitor(LocalizationSensor::imu).state == SensorState::excluded;
  AlignmentPrior prior{std::max(options_.imu.gyro_bias_sigma_rad_s, changed ? kChangedGyroBias_rad_s : 0),
                       std::max(options_.imu.accel_bias_sigma_m_s2, changed ? kChangedAccelBias_m_s2 : 0),
                       options_.gravity_m_s2,
                       std::sqrt(memory_.estimate.covariance(error_at::kImuTime, error_at::kImuTime)),
                       std::nullopt,
                       0};
  if (!memory_.gravity_known) return prior;
  const UpInBody up = up_in_body(memory_.estimate.state, error_at::kVisionClone);
  const Eigen::Matrix3d covariance = up.jacobian * memory_.estimate.covariance * up.jacobian.transpose();
  prior.up = up.up;
  prior.up_sigma_rad = kUpFactor * std::sqrt(covariance.trace());
  return prior;
}

/// Takes over biases and velocity, of which nothing is known. The direction of gravity in the body frame corrects
/// attitude and tilt, with the noise that it shares with the errors of the biases and the velocity.
void ErrorStateFilter::align(const InertialAlignment& a) {
  NavigationState& s = memory_.estimate.state;
  ErrorCovariance& p = memory_.estimate.covariance;
  s.velocity_m_s = a.velocity_m_s;
  s.gyro_bias_rad_s = a.gyro_bias_rad_s;
  s.accel_bias_m_s2 = a.accel_bias_m_s2;
  if (!memory_.gravity_known) s.gravity_tilt_rad = tilt_of_up(s.world_from_vision_clone.rotation() * a.up);

  s.imu_time_offset_s += a.time_offset_s;

  // Velocity, biases and clock, in the order of the state.
  constexpr int kCount = 10;
  Eigen::Array<int, kCount, 1> at;
  at << Eigen::Array<int, 9, 1>::LinSpaced(error_at::kVelocity, error_at::kVelocity + 8), error_at::kImuTime;
  static_assert(error_at::kGyroBias == error_at::kVelocity + 3 && error_at::kAccelBias == error_at::kVelocity + 6);
  Eigen::Matrix<double, kCount, 13> selection = Eigen::Matrix<double, kCount, 13>::Zero();
  selection.block<3, 3>(0, 6).setIdentity();
  selection.block<6, 6>(3, 0).setIdentity();
  selection(9, 12) = 1;
  p(at, Eigen::all).setZero();
  p(Eigen::all, at).setZero();
  if (memory_.estimate.past) memory_.estimate.past->with_present(Eigen::all, at).setZero();
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
  correct_world(innovation);
  memory_.imu.aligned = memory_.gravity_known = true;
  memory_.imu.window = {};
  memory_.monitor(LocalizationSensor::imu).readmit();
}

void ErrorStateFilter::detect_stationary(const ImuSample& sample) {
  StationaryBlock& b = memory_.imu.block;
  b.gyro += sample.gyro_rad_s;
  b.accel += sample.accel_m_s2;
  b.gyro_squares += sample.gyro_rad_s.cwiseAbs2();
  b.accel_squares += sample.accel_m_s2.cwiseAbs2();
  ++b.count;
  if (seconds_between(b.from, sample.stamp) < options_.zero_velocity.block_s) return;
  const auto scatter = [&](const Eigen::Vector3d& squares, const Eigen::Vector3d& sum) {
    return std::sqrt((squares / b.count - (sum / b.count).cwiseAbs2()).cwiseMax(0).maxCoeff());
  };
  const Eigen::Vector3d rate = b.gyro / b.count - memory_.estimate.state.gyro_bias_rad_s;
  const double interval = seconds_between(b.from, sample.stamp) / b.count;
  const double bias_sigma =
      std::sqrt(memory_.estimate.covariance.diagonal().segment<3>(error_at::kGyroBias).maxCoeff());
  const bool stationary = b.count >= 3 && scatter(b.gyro_squares, b.gyro) < options_.imu.stationary_gyro(interval) &&
                          scatter(b.accel_squares, b.accel) < options_.imu.stationary_accel(interval) &&
                          rate.norm() < options_.imu.stationary_gyro_rad_s + 3 * bias_sigma;
  b = {};
  b.from = sample.stamp;
  update_zero_velocity(stationary);
}

}  // namespace spartan::internal
