// Zero-velocity updates (ZUPT): a rover that stands keeps the pose where its stop began.
#pragma once

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/internal/updates/sensor_gates.h"
#include "spartan/localization/localization_options.h"

namespace spartan::internal {

/// A smooth drive looks stationary to an IMU, and a rover may slide on stationary wheels. So two sensors (the IMU and
/// the wheels, or the IMU and vision) and a chi-square test against the filter's own motion are required.
class ZeroVelocityUpdate {
 public:
  explicit ZeroVelocityUpdate(const LocalizationOptions& options);

  /// A sample of the IMU, to whose time the memory was propagated. Decides at the end of each block of samples.
  void add(FilterMemory& memory, const ImuSample& sample) const;

 private:
  bool imu_stationary(const FilterMemory& memory, const ImuSample& sample) const;
  bool wheels_stationary(const FilterMemory& memory) const;
  void update(FilterMemory& memory, bool imu_stationary) const;

  ZeroVelocityOptions options_;
  InertialOptions imu_;
  double wheels_timeout_s_;
  SensorGates gates_;
};

}  // namespace spartan::internal
