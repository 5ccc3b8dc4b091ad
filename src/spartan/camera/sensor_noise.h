// How sensors err, as a recording states it. Zeros: not stated.
#pragma once

#include "spartan/core/options.h"

namespace spartan {

/// As of an Allan deviation: white noise by density, biases by their standard deviation at the start and a random walk.
struct ImuNoise {
  double gyro_noise_rad_s_sqrt_hz = 0;
  double gyro_bias_rad_s = 0;
  double gyro_walk_rad_s2_sqrt_hz = 0;
  double accel_noise_m_s2_sqrt_hz = 0;
  double accel_bias_m_s2 = 0;
  double accel_walk_m_s3_sqrt_hz = 0;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("gyro_noise_rad_s_sqrt_hz", gyro_noise_rad_s_sqrt_hz, "white noise, density", between(0, 1));
    v.field("gyro_bias_rad_s", gyro_bias_rad_s, "standard deviation of the bias at the start", between(0, 1));
    v.field("gyro_walk_rad_s2_sqrt_hz", gyro_walk_rad_s2_sqrt_hz, "random walk of the bias", between(0, 1));
    v.field("accel_noise_m_s2_sqrt_hz", accel_noise_m_s2_sqrt_hz, "white noise, density", between(0, 10));
    v.field("accel_bias_m_s2", accel_bias_m_s2, "standard deviation of the bias at the start", between(0, 10));
    v.field("accel_walk_m_s3_sqrt_hz", accel_walk_m_s3_sqrt_hz, "random walk of the bias", between(0, 10));
  }
};

/// Beside the standard deviation that each reading carries.
struct CompassNoise {
  double offset_walk_rad_sqrt_hz = 0;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("offset_walk_rad_sqrt_hz", offset_walk_rad_sqrt_hz, "random walk of the offset", between(0, 1));
  }
};

/// Beside the standard deviation that each reading carries.
struct InclinometerNoise {
  double bias_rad = 0;
  double bias_walk_rad_sqrt_hz = 0;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("bias_rad", bias_rad, "standard deviation of the bias at the start", between(0, 1));
    v.field("bias_walk_rad_sqrt_hz", bias_walk_rad_sqrt_hz, "random walk of the bias", between(0, 1));
  }
};

struct SensorNoise {
  ImuNoise imu;
  CompassNoise compass;
  InclinometerNoise inclinometer;
};

}  // namespace spartan
