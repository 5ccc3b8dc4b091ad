// Constraints on the pose by matches of maps.
#pragma once

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/internal/lever_arm.h"
#include "spartan/localization/internal/updates/sensor_gates.h"
#include "spartan/localization/localization_options.h"

namespace spartan::internal {

class MapUpdate {
 public:
  explicit MapUpdate(const LocalizationOptions& options)
      : arm_(options.imu.position_m), covariance_factor_(options.map_factor), gates_(options) {}

  /// The memory must be that of the time of the constraint.
  void update(FilterMemory& memory, const PoseConstraint& constraint) const;
  /// Of the pose at the last frame; ignored if that is another one.
  void update(FilterMemory& memory, const LateConstraint& constraint) const;

 private:
  void apply(FilterMemory& memory, const PoseConstraint& of_body, int pose) const;

  LeverArm arm_;
  double covariance_factor_;
  SensorGates gates_;
};

}  // namespace spartan::internal
