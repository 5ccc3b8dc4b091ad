#include <fmt/format.h>

#include <limits>
#include <string>

#include "spartan/localization/localizer.h"

namespace spartan {
namespace {

std::string text_of(double nis) {
  return nis < std::numeric_limits<double>::max() ? fmt::format("{:.1f}", nis) : "infinite";
}

}  // namespace

std::string_view name_of(LocalizationSensor sensor) {
  switch (sensor) {
    case LocalizationSensor::vision:
      return "vision";
    case LocalizationSensor::imu:
      return "imu";
    case LocalizationSensor::wheels:
      return "wheels";
    case LocalizationSensor::compass:
      return "compass";
    case LocalizationSensor::inclinometer:
      return "inclinometer";
    case LocalizationSensor::map:
      return "map";
  }
  return "unknown";
}

std::string_view name_of(SensorState state) {
  switch (state) {
    case SensorState::ok:
      return "ok";
    case SensorState::suspect:
      return "suspect";
    case SensorState::excluded:
      return "excluded";
    case SensorState::missing:
      return "missing";
  }
  return "unknown";
}

void RefusalCounts::count(Refusal refusal) {
  switch (refusal) {
    case Refusal::not_finite:
      ++not_finite;
      break;
    case Refusal::too_late:
      ++too_late;
      break;
    case Refusal::too_early:
      ++too_early;
      break;
    case Refusal::duplicate:
      ++duplicates;
      break;
    case Refusal::reversed:
      ++reversed;
      break;
  }
}

void SensorMonitor::see(Stamp stamp) {
  seen = true;
  last = stamp;
}

bool SensorMonitor::accept(double normalized_innovation_squared, double gate, HealthReason why, int excluded_after,
                           int readmit_after) {
  if (!(normalized_innovation_squared <= gate)) {
    ++rejected;
    ++failed_in_row;
    passed_in_row = 0;
    reason = why;
    nis = normalized_innovation_squared;
    limit = gate;
    state = state == SensorState::excluded || failed_in_row >= excluded_after ? SensorState::excluded
                                                                              : SensorState::suspect;
    return false;
  }
  failed_in_row = 0;
  ++passed_in_row;
  if (state == SensorState::excluded && passed_in_row < readmit_after) {
    ++rejected;
    return false;
  }
  readmit();
  ++used;
  return true;
}

void SensorMonitor::exclude(HealthReason why) {
  state = SensorState::excluded;
  reason = why;
  nis = limit = 0;
  passed_in_row = 0;
}

void SensorMonitor::readmit() {
  state = SensorState::ok;
  reason = HealthReason::none;
  failed_in_row = 0;
}

bool SensorMonitor::missing(Stamp now, double timeout_s) const {
  return !seen || seconds_between(last, now) > timeout_s;
}

SensorHealth SensorMonitor::report(Stamp now, double timeout_s, const RefusalCounts& refusals) const {
  SensorHealth health;
  health.state = missing(now, timeout_s) ? SensorState::missing : state;
  health.used = used;
  health.rejected = rejected;
  health.refused = refusals;
  health.test = test;
  HealthReason why = reason;
  if (health.state == SensorState::missing) why = seen ? HealthReason::silent : HealthReason::never_seen;
  switch (why) {
    case HealthReason::none:
      break;
    case HealthReason::disagrees:
      health.reason = fmt::format("disagrees with the other sensors: NIS {} above the chi-square gate of {:.1f}",
                                  text_of(nis), limit);
      break;
    case HealthReason::slips:
      health.reason = fmt::format("the wheels slip: NIS {} above the chi-square gate of {:.1f}", text_of(nis), limit);
      break;
    case HealthReason::frozen:
      health.reason = "readings are frozen (identical values)";
      break;
    case HealthReason::out_of_range:
      health.reason = "readings are outside of the physical range";
      break;
    case HealthReason::contradicted:
      health.reason =
          fmt::format("contradicts visual odometry: NIS {} above the chi-square gate of {:.1f}", text_of(nis), limit);
      break;
    case HealthReason::not_aligned:
      health.reason = "its readings fit the motions by vision with no biases and direction of gravity";
      break;
    case HealthReason::wild:
      health.reason = "its motion contradicts the IMU or the wheels by far";
      break;
    case HealthReason::outvoted:
      health.reason = fmt::format("contradicts the IMU and the wheels, which agree: NIS {} above the gate of {:.1f}",
                                  text_of(nis), limit);
      break;
    case HealthReason::implausible:
      health.reason = "its motion is far off what those before it predict, and no other sensor confirms it";
      break;
    case HealthReason::lost:
      health.reason = "no motion estimate for the last frame";
      break;
    case HealthReason::never_seen:
      health.reason = "no measurement received yet";
      break;
    case HealthReason::silent:
      health.reason = fmt::format("no measurement for {:.1f} s", seconds_between(last, now));
      break;
  }
  return health;
}

}  // namespace spartan
