// Test fixture of this module: a drive in closed form with the samples of ideal and noisy sensors.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "spartan/localization/internal/error_state.h"
#include "spartan/localization/localizer.h"
#include "spartan/numerics/random.h"

namespace spartan::internal {

inline Stamp test_stamp(double seconds) {
  return {1'000'000'000'000 + std::llround(seconds * 1e9)};
}

/// A rover that is stationary for 2.5 s and then drives a winding path over waves at 6 cm/s.
struct TestDrive {
  double gravity_m_s2 = 3.71;
  double speed_m_s = 0.06;
  double swing_m = 0.4, swing_per_m = 1.1;
  double relief_m = 0.05, relief_per_m = 2.3;
  double roll_rad = 0.05;

  double travelled(double t) const {
    const double tau = t - 2.5;
    return tau <= 0 ? 0 : speed_m_s * tau * tau * tau / (tau * tau + 1);
  }
  Pose at(double t) const {
    const double u = travelled(t);
    const double yaw = std::atan(swing_m * swing_per_m * std::sin(swing_per_m * u));
    const double pitch = -std::atan(relief_m * relief_per_m * std::sin(relief_per_m * u) * std::cos(yaw));
    const Eigen::Quaterniond turn = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(roll_rad * std::sin(1.7 * u), Eigen::Vector3d::UnitX());
    return {turn, {u, swing_m * (1 - std::cos(swing_per_m * u)), relief_m * (1 - std::cos(relief_per_m * u))}};
  }
  Eigen::Vector3d velocity(double t) const {
    constexpr double h = 1e-4;
    return (at(t + h).translation() - at(t - h).translation()) / (2 * h);
  }
  ImuSample imu(double t) const {
    constexpr double h = 1e-3;
    const Pose now = at(t), before = at(t - h), after = at(t + h);
    const Eigen::Vector3d acceleration = (after.translation() - 2 * now.translation() + before.translation()) / (h * h);
    return {test_stamp(t), log_so3(before.rotation().conjugate() * after.rotation()) / (2 * h),
            now.rotation().conjugate() * (acceleration + Eigen::Vector3d(0, 0, gravity_m_s2))};
  }
  /// Path length, which the wheels count.
  double rolled(double t) const {
    double sum = 0;
    for (double s = 2.5; s < t; s += 0.05)
      sum += (at(std::min(s + 0.05, t)).translation() - at(s).translation()).norm();
    return sum;
  }
  RelativeMotion motion(double from, double to, const Matrix6d& covariance) const {
    return {test_stamp(from), test_stamp(to), at(from).inverse() * at(to), covariance, true};
  }
};

inline Matrix6d test_motion_covariance() {
  Vector6d sigma;
  sigma << 3e-5, 2e-5, 3e-5, 4e-5, 3e-5, 3e-5;
  return sigma.cwiseAbs2().asDiagonal();
}

inline Eigen::Vector3d normal3(Random& random, double sigma) {
  return {random.normal(0, sigma), random.normal(0, sigma), random.normal(0, sigma)};
}

struct TestSensors {
  bool imu = true, wheels = true, compass = true, inclinometer = true;
  double noise = 1;  ///< 0: ideal
};

/// Everything but vision, in order of time, from 0 to `seconds`.
inline std::vector<Measurement> test_samples(const TestDrive& drive, double seconds, const TestSensors& with,
                                             std::uint64_t seed) {
  Random random(seed, 77);
  std::vector<Measurement> samples;
  const Eigen::Vector3d gyro_bias = normal3(random, with.noise * 5e-5), accel_bias = normal3(random, with.noise * 5e-3);
  double rolled = 0;
  Eigen::Vector3d last = drive.at(0).translation();
  for (int i = 0; i <= static_cast<int>(seconds * 100); ++i) {
    const double t = i * 0.01;
    if (with.imu) {
      ImuSample s = drive.imu(t);
      s.gyro_rad_s += gyro_bias + normal3(random, with.noise * 1e-3);
      s.accel_m_s2 += accel_bias + normal3(random, with.noise * 1e-2);
      samples.emplace_back(s);
    }
    const Pose pose = drive.at(t);
    rolled += (pose.translation() - last).norm();
    last = pose.translation();
    const double counted = rolled / 0.98;
    if (with.wheels && i % 5 == 0) samples.emplace_back(WheelSample{test_stamp(t), counted, counted});
    if (with.compass && i % 100 == 0) {
      const Eigen::Vector3d ahead = pose.rotation() * Eigen::Vector3d::UnitX();
      samples.emplace_back(
          CompassSample{test_stamp(t), std::atan2(ahead.y(), ahead.x()) + random.normal(0, with.noise * 0.017), 0.017});
    }
    if (with.inclinometer && i % 20 == 0) {
      const Eigen::Vector3d up = pose.rotation().conjugate() * Eigen::Vector3d::UnitZ();
      samples.emplace_back(InclinometerSample{
          test_stamp(t), std::atan2(up.y(), up.z()) + random.normal(0, with.noise * 0.0035),
          std::atan2(-up.x(), std::hypot(up.y(), up.z())) + random.normal(0, with.noise * 0.0035), 0.0035});
    }
  }
  return samples;
}

/// Visual motions from 2.5 s on, every 1.5 s, with noise of their covariance.
inline std::vector<Measurement> test_motions(const TestDrive& drive, double seconds, double noise, std::uint64_t seed) {
  Random random(seed, 78);
  std::vector<Measurement> motions;
  for (double t = 2.5; t + 1.5 <= seconds + 1e-9; t += 1.5) {
    RelativeMotion m = drive.motion(t, t + 1.5, test_motion_covariance());
    Vector6d error;
    for (int i = 0; i < 6; ++i) error[i] = random.normal(0, noise * std::sqrt(m.covariance(i, i)));
    m.previous_from_current = m.previous_from_current * exp_se3(error);
    motions.emplace_back(m);
  }
  return motions;
}

/// All samples of the drive in order of time.
inline std::vector<Measurement> in_order(std::vector<Measurement> a, const std::vector<Measurement>& b) {
  a.insert(a.end(), b.begin(), b.end());
  std::stable_sort(a.begin(), a.end(), comes_before);
  return a;
}

/// A localizer that starts at 2.5 s and is given all samples.
inline Localizer driven(const LocalizationOptions& options, const std::vector<Measurement>& all) {
  Localizer localizer = Localizer::create(options).value();
  bool started = false;
  for (const Measurement& m : all) {
    if (!started && stamp_of_measurement(m) > test_stamp(2.5)) {
      localizer.start(test_stamp(2.5), Eigen::Vector3d::UnitX());
      started = true;
    }
    localizer.add(m);
  }
  return localizer;
}

inline LocalizationOptions test_options() {
  LocalizationOptions o;
  o.gravity_m_s2 = 3.71;
  o.vision.white_noise_factor = 1;
  o.vision.drift_sigma_ratios = o.vision.constant_sigma_ratios = {0, 0, 0, 0, 0, 0};
  return o;
}

inline NavigationState random_navigation_state(Random& random) {
  const auto tangent = [&](double t, double r) {
    Vector6d v;
    for (int i = 0; i < 6; ++i) v[i] = random.uniform(-1, 1) * (i < 3 ? t : r);
    return v;
  };
  NavigationState s;
  s.world_from_body = exp_se3(tangent(5, 1));
  s.velocity_m_s = normal3(random, 1);
  s.gyro_bias_rad_s = normal3(random, 0.1);
  s.accel_bias_m_s2 = normal3(random, 0.1);
  s.gravity_tilt_rad = {random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2)};
  s.gravity_scale = random.uniform(0.9, 1.1);
  s.wheel_scale = random.uniform(0.9, 1.1);
  s.compass_offset_rad = random.uniform(-3, 3);
  s.inclinometer_bias_rad = {random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1)};
  for (int i = 0; i < 6; ++i) s.vision_drift[i] = random.normal(), s.vision_constant[i] = random.normal();
  for (int i = 0; i < 8; ++i) s.calibration[i] = random.normal();
  s.world_from_vision_clone = s.world_from_body * exp_se3(tangent(0.3, 0.2));
  s.world_from_step_clone = s.world_from_body * exp_se3(tangent(0.3, 0.2));
  return s;
}

}  // namespace spartan::internal
