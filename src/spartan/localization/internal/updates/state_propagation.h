// Propagation of the filter to a later time: by the IMU where it is usable, with constant velocity elsewhere.
#pragma once

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/localization_options.h"

namespace spartan::internal {

class StatePropagation {
 public:
  explicit StatePropagation(const LocalizationOptions& options);

  /// Nothing is done for times that are not later. With an IMU sample at or after that time (`next`) both ends of the
  /// step are measured; otherwise the last reading is held, up to InertialOptions::timeout_s.
  void propagate_to(FilterMemory& memory, Stamp stamp, const ImuSample* next) const;

 private:
  void propagate_inertially(FilterMemory& memory, double seconds, const ImuSample& from, const ImuSample& to) const;
  void propagate_at_constant_velocity(FilterMemory& memory, double seconds) const;
  void propagate_biases(ErrorCovariance& p, double seconds) const;

  double gravity_m_s2_;
  InertialOptions imu_;
  ConstantVelocityOptions constant_velocity_;
  double wheel_scale_sigma_, wheel_scale_walk_, compass_offset_walk_, inclinometer_bias_walk_;
};

}  // namespace spartan::internal
