#include "spartan/localization/error_state_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "spartan/localization/drive_test.h"

namespace spartan {
namespace {

ErrorStateFilter started(const LocalizationOptions& options, const TestSensors& with) {
  ErrorStateFilter filter(options);
  filter.start(test_stamp(2.5), Eigen::Vector3d::UnitX(), test_samples(TestDrive(), 2.5, with, 71));
  return filter;
}

TEST(ErrorStateFilter, LevellingTiesTheTiltToTheAccelerometersBias) {
  // f̄ = g up(τ) + b: what the mean leaves open is shared, τ_x = b_y / g and τ_y = −b_x / g but for the mean's own
  // noise.
  const LocalizationOptions o = test_options();
  const ErrorStateFilter filter = started(o, {true, false, false, false});
  const ErrorCovariance& p = filter.memory().belief.covariance;
  const double by_bias = o.imu.accel_bias_m_s2 / o.gravity_m_s2;
  EXPECT_NEAR(std::sqrt(p(error_at::kGravityTilt, error_at::kGravityTilt)), by_bias, 0.02 * by_bias);
  const auto correlation = [&](int i, int j) { return p(i, j) / std::sqrt(p(i, i) * p(j, j)); };
  EXPECT_GT(std::abs(correlation(error_at::kGravityTilt, error_at::kAccelBias + 1)), 0.99);
  EXPECT_GT(std::abs(correlation(error_at::kGravityTilt + 1, error_at::kAccelBias)), 0.99);
  EXPECT_LT(std::abs(correlation(error_at::kGravityTilt, error_at::kAccelBias)), 0.05);
  // The pose defines the world and stays exact.
  EXPECT_LT(p.diagonal().head<6>().maxCoeff(), 1e-11);
}

TEST(ErrorStateFilter, RestFindsTheGyrosBias) {
  const LocalizationOptions o = test_options();
  const ErrorStateFilter filter = started(o, {true, false, false, false});
  Random random(71, 77);
  const Eigen::Vector3d bias = normal3(random, 5e-5);  // as test_samples draws it
  const double sigma = std::sqrt(filter.memory().belief.covariance(error_at::kGyroBias, error_at::kGyroBias));
  EXPECT_LT(sigma, o.imu.gyro_noise_rad_s_sqrt_hz / std::sqrt(2.0));
  EXPECT_LE((filter.memory().belief.state.gyro_bias_rad_s - bias).cwiseAbs().maxCoeff(), 4 * sigma);
}

TEST(ErrorStateFilter, WithoutAnythingAtTheStartTheVerticalIsOpen) {
  const ErrorStateFilter filter = started(test_options(), {false, false, false, false});
  EXPECT_FALSE(filter.memory().gravity_measured);
  EXPECT_GT(filter.memory().belief.covariance(error_at::kGravityTilt, error_at::kGravityTilt), 0.1);
}

}  // namespace
}  // namespace spartan
