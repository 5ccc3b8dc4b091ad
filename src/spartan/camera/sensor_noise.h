// Specified sensor noise of a recording. Zero: unknown.
#pragma once

#include "spartan/core/options.h"

namespace spartan {

/// IMU noise model as identified from an Allan deviation: white noise by its density; bias by its initial standard
/// deviation and its random walk.
struct ImuNoise {
  double gyro_noise_rad_s_sqrt_hz = 0;  ///< white noise density of the angular rate, rad/s/√Hz
  double gyro_bias_rad_s = 0;           ///< standard deviation of the initial gyroscope bias, rad/s
  double gyro_walk_rad_s2_sqrt_hz = 0;  ///< random walk of the gyroscope bias, rad/s²/√Hz
  double accel_noise_m_s2_sqrt_hz = 0;  ///< white noise density of the specific force, m/s²/√Hz
  double accel_bias_m_s2 = 0;           ///< standard deviation of the initial accelerometer bias, m/s²
  double accel_walk_m_s3_sqrt_hz = 0;   ///< random walk of the accelerometer bias, m/s³/√Hz

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("gyro_noise_rad_s_sqrt_hz", gyro_noise_rad_s_sqrt_hz,
            "White noise density of the gyroscope in rad/s/√Hz; 0 means unknown.", between(0, 1));
    v.field("gyro_bias_rad_s", gyro_bias_rad_s,
            "Standard deviation of the initial gyroscope bias in rad/s; 0 means unknown.", between(0, 1));
    v.field("gyro_walk_rad_s2_sqrt_hz", gyro_walk_rad_s2_sqrt_hz,
            "Random walk of the gyroscope bias in rad/s²/√Hz; 0 means unknown.", between(0, 1));
    v.field("accel_noise_m_s2_sqrt_hz", accel_noise_m_s2_sqrt_hz,
            "White noise density of the accelerometer in m/s²/√Hz; 0 means unknown.", between(0, 10));
    v.field("accel_bias_m_s2", accel_bias_m_s2,
            "Standard deviation of the initial accelerometer bias in m/s²; 0 means unknown.", between(0, 10));
    v.field("accel_walk_m_s3_sqrt_hz", accel_walk_m_s3_sqrt_hz,
            "Random walk of the accelerometer bias in m/s³/√Hz; 0 means unknown.", between(0, 10));
  }
};

/// Compass errors in addition to the standard deviation of each sample.
struct CompassNoise {
  double offset_walk_rad_sqrt_hz = 0;  ///< random walk of the heading offset, rad/s/√Hz

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("offset_walk_rad_sqrt_hz", offset_walk_rad_sqrt_hz,
            "Random walk of the compass offset in rad/s/√Hz; 0 means unknown.", between(0, 1));
  }
};

/// Inclinometer errors in addition to the standard deviation of each sample.
struct InclinometerNoise {
  double bias_rad = 0;               ///< standard deviation of the initial bias, rad
  double bias_walk_rad_sqrt_hz = 0;  ///< random walk of the bias, rad/s/√Hz

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("bias_rad", bias_rad, "Standard deviation of the initial inclinometer bias in rad; 0 means unknown.",
            between(0, 1));
    v.field("bias_walk_rad_sqrt_hz", bias_walk_rad_sqrt_hz,
            "Random walk of the inclinometer bias in rad/s/√Hz; 0 means unknown.", between(0, 1));
  }
};

/// Specified noise of all sensors of a recording.
struct SensorNoise {
  ImuNoise imu;
  CompassNoise compass;
  InclinometerNoise inclinometer;
};

}  // namespace spartan
