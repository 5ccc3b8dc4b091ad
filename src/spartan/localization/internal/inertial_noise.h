// White noise of an IMU as its readings show it.
#pragma once

#include <Eigen/Core>

#include "spartan/camera/samples.h"
#include "spartan/localization/internal/propagation.h"
#include "spartan/localization/localization_options.h"

namespace spartan::internal {

/// Vibrations of a vehicle can be far above the noise of its IMU, and a data sheet can be wrong. The differences of
/// consecutive readings of white noise of the standard deviation σ have a variance of 2 σ², whatever the slower motion
/// of the vehicle; σ √t is the density of that noise at intervals of t.
struct InertialNoiseEstimate {
  Eigen::Vector3d gyro_variance = Eigen::Vector3d::Zero(), accel_variance = Eigen::Vector3d::Zero();  ///< of a reading
  double seconds = 0;     ///< since the first reading, up to the averaging time
  double interval_s = 0;  ///< mean time between readings

  void add(const ImuSample& before, const ImuSample& sample);
};

/// The densities that the options state, or those of the readings where they are larger.
InertialNoise inertial_noise(const InertialOptions& options, const InertialNoiseEstimate& estimate);

}  // namespace spartan::internal
