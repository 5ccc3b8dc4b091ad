#include "spartan/localization/internal/inertial_noise.h"

#include <algorithm>

namespace spartan::internal {
namespace {

/// Time over which the variances are averaged, and the time after which they are used.
constexpr double kAverage_s = 0.5, kFirst_s = 0.1;
/// Longest interval between readings whose difference shows noise and not motion.
constexpr double kMaxInterval_s = 0.05;

}  // namespace

void InertialNoiseEstimate::add(const ImuSample& before, const ImuSample& sample) {
  const double t = seconds_between(before.stamp, sample.stamp);
  if (!(t > 0) || t > kMaxInterval_s) return;
  seconds = std::min(seconds + t, kAverage_s);
  const double weight = std::min(1.0, t / seconds);
  gyro_variance += weight * (0.5 * (sample.gyro_rad_s - before.gyro_rad_s).cwiseAbs2() - gyro_variance);
  accel_variance += weight * (0.5 * (sample.accel_m_s2 - before.accel_m_s2).cwiseAbs2() - accel_variance);
  interval_s += weight * (t - interval_s);
}

InertialNoise inertial_noise(const InertialOptions& options, const InertialNoiseEstimate& estimate) {
  InertialNoise noise;
  noise.gyro.setConstant(options.gyro_noise_rad_s_sqrt_hz);
  noise.accel.setConstant(options.accel_noise_m_s2_sqrt_hz);
  noise.gyro_walk = options.gyro_walk_rad_s2_sqrt_hz;
  noise.accel_walk = options.accel_walk_m_s3_sqrt_hz;
  if (estimate.seconds < kFirst_s) return noise;
  noise.gyro = noise.gyro.cwiseMax((estimate.gyro_variance * estimate.interval_s).cwiseSqrt());
  noise.accel = noise.accel.cwiseMax((estimate.accel_variance * estimate.interval_s).cwiseSqrt());
  return noise;
}

}  // namespace spartan::internal
