// Headings of a compass.
#pragma once

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/internal/updates/sensor_gates.h"
#include "spartan/localization/localization_options.h"

namespace spartan::internal {

class CompassUpdate {
 public:
  explicit CompassUpdate(const LocalizationOptions& options) : options_(options.compass), gates_(options) {}

  /// The memory must be that of the time of the reading. The offset to the headings of the world is a state. Of a
  /// compass that starts during the drive it is the consensus of the first readings.
  void update(FilterMemory& memory, const CompassSample& sample) const;

 private:
  void initialize_offset(FilterMemory& memory, const CompassSample& sample, double sigma_rad) const;

  HeadingOptions options_;
  SensorGates gates_;
};

}  // namespace spartan::internal
