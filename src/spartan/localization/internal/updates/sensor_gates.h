// Chi-square tests of the innovations of all sensors.
#pragma once

#include <optional>

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
  /// The same for visual motions, whose decision (motion_decision.h) is not always that of a test: `tested` is the
  /// normalized innovation squared against the prediction by the IMU, none without one.
  bool accept_motion(FilterMemory& memory, const MotionDecision& decision, std::optional<double> tested) const;

  const MotionGates& limits() const { return limits_; }
  double limit(int rows) const { return limits_.by_rows[static_cast<std::size_t>(rows)]; }

 private:
  bool count(SensorMonitor& monitor, double nis, double limit, HealthReason why) const;
  MotionGates limits_;
  int excluded_after_, readmit_after_;
};

}  // namespace spartan::internal
