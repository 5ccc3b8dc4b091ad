// Sensor monitoring: whether a sensor is used, and why not.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "spartan/core/time.h"

namespace spartan {

enum class LocalizationSensor : std::uint8_t { vision, imu, wheels, compass, inclinometer, map };
inline constexpr int kLocalizationSensors = 6;
std::string_view name_of(LocalizationSensor sensor);

enum class SensorState : std::uint8_t {
  ok,
  suspect,   ///< its last sample was rejected
  excluded,  ///< not used; its samples are still gated, and enough consistent ones readmit it
  missing,   ///< no samples within its timeout
};
std::string_view name_of(SensorState state);

enum class HealthReason : std::uint8_t {
  none,
  disagrees,     ///< failed a chi-square test
  slips,         ///< the wheels' count differs from the motion of the rover
  frozen,        ///< identical readings
  out_of_range,  ///< rate or specific force beyond the physical range of a rover
  contradicted,  ///< vision contradicts its prediction
  lost,          ///< vision could not measure the motion
  never_seen,
  silent,
};

/// Why a sample is refused before it reaches the filter.
enum class Refusal : std::uint8_t { not_finite, too_late, too_early, duplicate, reversed };

/// Number of refused samples by reason.
struct RefusalCounts {
  std::int64_t not_finite = 0, too_late = 0, too_early = 0, duplicates = 0, reversed = 0;
  void count(Refusal refusal);
};

/// Report on a sensor at a time.
struct SensorHealth {
  SensorState state = SensorState::missing;
  std::string reason;                   ///< empty if the state is ok
  std::int64_t used = 0, rejected = 0;  ///< by the filter
  RefusalCounts refused;                ///< before the filter
};

/// Monitors one sensor by gating: ok → suspect at the first rejection, excluded after `excluded_after` consecutive
/// ones, readmitted after `readmit_after` consecutive samples that pass.
struct SensorMonitor {
  bool seen = false;
  Stamp last;
  SensorState state = SensorState::ok;  ///< never `missing`, which follows from `last`
  HealthReason reason = HealthReason::none;
  double nis = 0;  ///< normalized innovation squared that failed, and its gate
  double limit = 0;
  std::int64_t used = 0, rejected = 0;
  int passed_in_row = 0, failed_in_row = 0;

  void see(Stamp stamp);
  /// Returns whether the sample is used: it passes the gate and the sensor is not, or no longer, excluded.
  bool accept(double normalized_innovation_squared, double gate, HealthReason why, int excluded_after,
              int readmit_after);
  void exclude(HealthReason why);
  void readmit();

  bool missing(Stamp now, double timeout_s) const;
  SensorHealth report(Stamp now, double timeout_s, const RefusalCounts& refusals) const;
};

}  // namespace spartan
