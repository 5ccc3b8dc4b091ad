// Chi-square tests of the innovations of all sensors.
#pragma once

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/internal/updates/motion_decision.h"
#include "spartan/localization/localization_options.h"
#include "spartan/localization/localizer.h"

namespace spartan::internal {

class SensorGates {
 public:
  explicit SensorGates(const LocalizationOptions& options);

  /// Tests a normalized innovation squared with `rows` degrees of freedom. The monitor of the sensor keeps the test,
  /// counts it, excludes the sensor or readmits it; returns whether the measurement may be used.
  bool accept(FilterMemory& memory, LocalizationSensor sensor, double nis, int rows, HealthReason why) const;
  /// The same with a limit of the caller's.
  bool accept_within(FilterMemory& memory, LocalizationSensor sensor, double nis, double limit, HealthReason why) const;
  /// The same for a measurement that there is no prediction to test against.
  bool accept_untested(FilterMemory& memory, LocalizationSensor sensor) const;

  const MotionGates& limits() const { return limits_; }
  double limit(int rows) const { return limits_.by_rows[static_cast<std::size_t>(rows)]; }

 private:
  MotionGates limits_;
  int excluded_after_, readmit_after_;
};

}  // namespace spartan::internal
