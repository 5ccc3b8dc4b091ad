#include "spartan/localization/internal/updates/imu_update.h"

#include <algorithm>
#include <cmath>

namespace spartan::internal {
namespace {

/// Physical range of IMU readings of a rover: about 2000 °/s and 30 g; empirical.
constexpr double kMaxRate_rad_s = 35, kMaxForce_m_s2 = 300;

}  // namespace

bool is_possible(const ImuSample& sample) {
  return sample.gyro_rad_s.cwiseAbs().maxCoeff() < kMaxRate_rad_s &&
         sample.accel_m_s2.cwiseAbs().maxCoeff() < kMaxForce_m_s2;
}

ImuUpdate::ImuUpdate(const LocalizationOptions& options)
    : options_(options.imu),
      readmit_after_(options.health.readmit_after),
      propagation_(options),
      initialization_(options),
      zero_velocity_(options) {}

void ImuUpdate::add(FilterMemory& memory, const ImuSample& by_own_clock) const {
  ImuQueue& waiting = memory.imu.waiting;
  if (waiting.full()) use_waiting_until(memory, at_frame_time(memory, waiting.front()).stamp);
  waiting.push(by_own_clock);
  Stamp reached = by_own_clock.stamp;
  reached.ns -= std::llround(options_.max_time_error_s() * 1e9);
  use_waiting_until(memory, reached);
}

void ImuUpdate::advance_to(FilterMemory& memory, Stamp stamp) const {
  use_waiting_until(memory, stamp);
  const ImuQueue& waiting = memory.imu.waiting;
  if (waiting.empty() || !is_possible(waiting.front())) {
    propagation_.propagate_to(memory, stamp, nullptr);
  } else {
    const ImuSample next = at_frame_time(memory, waiting.front());
    propagation_.propagate_to(memory, stamp, &next);
  }
}

/// Uses the readings that were taken up to that time.
void ImuUpdate::use_waiting_until(FilterMemory& memory, Stamp stamp) const {
  ImuQueue& waiting = memory.imu.waiting;
  while (!waiting.empty()) {
    const ImuSample sample = at_frame_time(memory, waiting.front());
    if (sample.stamp > stamp) return;
    waiting.pop();
    use(memory, sample);
  }
}

/// With the stamp by the clock of the cameras, as far as it is known; not before the present.
ImuSample ImuUpdate::at_frame_time(const FilterMemory& memory, const ImuSample& by_own_clock) const {
  const double limit = options_.max_time_error_s();
  const double offset_s = std::clamp(memory.estimate.state.imu_time_offset_s, -limit, limit);
  ImuSample sample = by_own_clock;
  sample.stamp.ns -= std::llround(offset_s * 1e9);
  if (limit > 0) sample.stamp = std::max(sample.stamp, memory.stamp);
  return sample;
}

void ImuUpdate::use(FilterMemory& memory, const ImuSample& sample) const {
  check_reading(memory, sample);
  InertialMemory& imu = memory.imu;
  if (imu.known) {
    imu.noise.add(imu.last, sample);
    if (!memory.inertial_usable()) initialization_.add(memory, sample);
  }
  propagation_.propagate_to(memory, sample.stamp, &sample);
  if (memory.inertial_usable()) ++memory.monitor(LocalizationSensor::imu).used;
  if (!imu.known) {
    imu.known = true;
    imu.changed = imu.block.from = imu.level_from = imu.waiting_since = sample.stamp;
  }
  imu.last = sample;
  zero_velocity_.add(memory, sample);
}

/// Readings beyond the physical range of a rover, and frozen ones, exclude the IMU; others readmit it.
void ImuUpdate::check_reading(FilterMemory& memory, const ImuSample& sample) const {
  SensorMonitor& monitor = memory.monitor(LocalizationSensor::imu);
  InertialMemory& imu = memory.imu;
  const bool same = imu.known && imu.last.gyro_rad_s == sample.gyro_rad_s && imu.last.accel_m_s2 == sample.accel_m_s2;
  if (!same) imu.changed = sample.stamp;
  const bool possible = is_possible(sample);
  const bool frozen = same && seconds_between(imu.changed, sample.stamp) >= options_.frozen_s;
  if (!possible || frozen) {
    ++monitor.rejected;
    monitor.exclude(possible ? HealthReason::frozen : HealthReason::out_of_range);
  } else if (monitor.state == SensorState::excluded && monitor.reason != HealthReason::contradicted && !same) {
    if (++monitor.passed_in_row >= readmit_after_) monitor.readmit();
  }
}

}  // namespace spartan::internal
