#include "spartan/localization/localization_options.h"

#include <algorithm>
#include <cmath>

namespace spartan {
namespace {

/// Largest scatter of a stationary sensor: its threshold, or twice its noise if that is more.
double largest_scatter(double threshold, double density, double interval_s) {
  return std::max(threshold, 2 * density / std::sqrt(std::max(interval_s, 1e-6)));
}

}  // namespace

double InertialOptions::max_time_error_s() const {
  return std::min(3 * time_offset_sigma_s, 0.1);
}

double InertialOptions::stationary_gyro(double interval_s) const {
  return largest_scatter(stationary_gyro_rad_s, gyro_noise_rad_s_sqrt_hz, interval_s);
}

double InertialOptions::stationary_accel(double interval_s) const {
  return largest_scatter(stationary_accel_m_s2, accel_noise_m_s2_sqrt_hz, interval_s);
}

LocalizationOptions with_specified_noise(LocalizationOptions options, const SensorNoise& specified,
                                         const GivenKeys& given) {
  const LocalizationOptions defaults;
  const auto take = [&](const char* key, double& value, double by_default, double by_recording) {
    if (!given.contains(key) && value == by_default && by_recording > 0) value = by_recording;
  };
  const auto take_imu = [&](const char* key, double InertialOptions::*ours, double ImuNoise::*theirs) {
    take(key, options.imu.*ours, defaults.imu.*ours, specified.imu.*theirs);
  };
  take_imu("imu.gyro_noise_rad_s_sqrt_hz", &InertialOptions::gyro_noise_rad_s_sqrt_hz,
           &ImuNoise::gyro_noise_rad_s_sqrt_hz);
  take_imu("imu.gyro_bias_sigma_rad_s", &InertialOptions::gyro_bias_sigma_rad_s, &ImuNoise::gyro_bias_rad_s);
  take_imu("imu.gyro_walk_rad_s2_sqrt_hz", &InertialOptions::gyro_walk_rad_s2_sqrt_hz,
           &ImuNoise::gyro_walk_rad_s2_sqrt_hz);
  take_imu("imu.accel_noise_m_s2_sqrt_hz", &InertialOptions::accel_noise_m_s2_sqrt_hz,
           &ImuNoise::accel_noise_m_s2_sqrt_hz);
  take_imu("imu.accel_bias_sigma_m_s2", &InertialOptions::accel_bias_sigma_m_s2, &ImuNoise::accel_bias_m_s2);
  take_imu("imu.accel_walk_m_s3_sqrt_hz", &InertialOptions::accel_walk_m_s3_sqrt_hz,
           &ImuNoise::accel_walk_m_s3_sqrt_hz);
  take("compass.offset_walk_rad_per_sqrt_s", options.compass.offset_walk_rad_per_sqrt_s,
       defaults.compass.offset_walk_rad_per_sqrt_s, specified.compass.offset_walk_rad_sqrt_hz);
  take("inclinometer.bias_sigma_rad", options.inclinometer.bias_sigma_rad, defaults.inclinometer.bias_sigma_rad,
       specified.inclinometer.bias_rad);
  take("inclinometer.bias_walk_rad_per_sqrt_s", options.inclinometer.bias_walk_rad_per_sqrt_s,
       defaults.inclinometer.bias_walk_rad_per_sqrt_s, specified.inclinometer.bias_walk_rad_sqrt_hz);
  return options;
}

}  // namespace spartan
