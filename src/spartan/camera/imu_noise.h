// How an IMU errs.
#pragma once

#include "spartan/core/options.h"

namespace spartan {

/// As of an Allan deviation: white noise by density, biases by their standard deviation at the start and a random walk.
/// Zeros: not stated.
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

}  // namespace spartan
