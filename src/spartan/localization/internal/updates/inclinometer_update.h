// Roll and pitch of an inclinometer.
#pragma once

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/internal/updates/sensor_gates.h"
#include "spartan/localization/localization_options.h"

namespace spartan::internal {

/// Standard deviation that a reading states, as the options take it.
double stated_sigma(const TiltOptions& options, const InclinometerSample& sample);

class InclinometerUpdate {
 public:
  explicit InclinometerUpdate(const LocalizationOptions& options) : options_(options.inclinometer), gates_(options) {}

  /// The memory must be that of the time of the reading. The first reading defines the vertical where nothing else has.
  void update(FilterMemory& memory, const InclinometerSample& sample) const;

 private:
  TiltOptions options_;
  SensorGates gates_;
};

}  // namespace spartan::internal
