// Whether a sensor is to be believed, and why not.
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
  suspect,   ///< its last sample was refused
  excluded,  ///< not used; its samples are still judged, and enough good ones bring it back
  missing,   ///< silent
};
std::string_view name_of(SensorState state);

enum class HealthReason : std::uint8_t {
  none,
  disagrees,     ///< failed a chi-square test
  slips,         ///< wheels turn otherwise than the rover moves
  frozen,        ///< the same reading again and again
  out_of_range,  ///< no such rate or force happens to a rover
  overruled,     ///< vision moved otherwise than it predicted
  lost,          ///< vision could not measure
  never_seen,
  silent,
};

/// What refuses samples before they reach the filter.
enum class Refusal : std::uint8_t { not_finite, too_late, too_early, duplicate, reversed };

/// Counts refusals; keeps nothing else.
struct RefusalCounts {
  std::int64_t not_finite = 0, too_late = 0, too_early = 0, duplicates = 0, reversed = 0;
  void count(Refusal refusal);
};

/// For people: what a sensor is worth at a moment.
struct SensorHealth {
  SensorState state = SensorState::missing;
  std::string reason;                   ///< empty where the state is ok
  std::int64_t used = 0, rejected = 0;  ///< by the filter
  RefusalCounts refused;                ///< before
};

/// The memory of one sensor's judge: ok → suspect at the first refusal, excluded after `excluded_after` in a row, back
/// after `back_after` in a row that pass.
struct SensorJudge {
  bool seen = false;
  Stamp last;
  SensorState state = SensorState::ok;  ///< never missing: that follows from `last`
  HealthReason reason = HealthReason::none;
  double square = 0;  ///< the statistic that failed, and its limit
  double limit = 0;
  std::int64_t used = 0, rejected = 0;
  int passed_in_row = 0, failed_in_row = 0;

  void see(Stamp stamp);
  /// Whether the sample is to be used: not where it fails, nor where the sensor is (still) excluded.
  bool judge(double normalised_square, double gate, HealthReason why, int excluded_after, int back_after);
  void exclude(HealthReason why);
  void readmit();

  bool missing(Stamp now, double timeout_s) const;
  SensorHealth report(Stamp now, double timeout_s, const RefusalCounts& refusals) const;
};

}  // namespace spartan
