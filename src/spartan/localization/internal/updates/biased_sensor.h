// Readings of the pose in the world by a sensor whose bias is a state and whose noise is measured.
#pragma once

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/internal/kalman_update.h"
#include "spartan/localization/internal/noise_ratio.h"
#include "spartan/localization/internal/updates/sensor_gates.h"

namespace spartan::internal {

struct BiasedSensor {
  LocalizationSensor sensor;
  int bias;                ///< index of the error of its bias, one for each row of an innovation
  double stated_variance;  ///< of a row, by the sensor alone
  NoiseRatio& noise;       ///< of the readings over that, measured beside a usable IMU
};

/// Gates a reading and corrects the state by it. Of a sensor that is excluded, the variance of the bias grows until one
/// that has changed permanently is readmitted.
void correct_by_reading(FilterMemory& memory, const Innovation& innovation, const BiasedSensor& of,
                        const SensorGates& gates);

}  // namespace spartan::internal
