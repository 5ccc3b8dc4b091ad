// Steps of the wheels, and the slip of the last one.
#pragma once

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/internal/updates/sensor_gates.h"
#include "spartan/localization/localization_options.h"

namespace spartan::internal {

class WheelUpdate {
 public:
  explicit WheelUpdate(const LocalizationOptions& options);

  /// The memory must be that of the time of the sample. Steps end after WheelOdometryOptions::max_step_s.
  void update(FilterMemory& memory, const WheelSample& sample) const;

  /// Steps end with frames, too, so that vision and wheels measure the same motion; at a high rate of frames not with
  /// each. `vision_alone`: it was not predicted by an IMU, and vision has measured it.
  void end_step_at_frame(FilterMemory& memory, Stamp stamp, bool vision_alone) const;

 private:
  void update_by_step(FilterMemory& memory, const WheelSample& sample) const;
  void estimate_slip(FilterMemory& memory, const WheelStep& step) const;

  WheelOdometryOptions options_;
  double stationary_m_, imu_timeout_s_;
  Eigen::Vector3d centre_;  ///< turning centre relative to the IMU
  SensorGates gates_;
};

}  // namespace spartan::internal
