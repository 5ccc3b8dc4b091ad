#include "spartan/localization/internal/error_state_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <variant>
#include <vector>

#include "spartan/localization/internal/drive_test.h"

namespace spartan::internal {
namespace {

ErrorStateFilter started(const LocalizationOptions& options, const TestSensors& with) {
  ErrorStateFilter filter(options);
  filter.start(test_stamp(2.5), Eigen::Vector3d::UnitX(), test_samples(TestDrive(), 2.5, with, 71));
  return filter;
}

TEST(ErrorStateFilter, StaticAlignmentCorrelatesTiltWithAccelerometerBias) {
  // f̄ = g up(τ) + b: the unobservable part is shared, τ_x = b_y / g and τ_y = −b_x / g but for the noise
  // of the mean.
  const LocalizationOptions o = test_options();
  const ErrorStateFilter filter = started(o, {true, false, false, false});
  const ErrorCovariance& p = filter.memory().estimate.covariance;
  const double by_bias = o.imu.accel_bias_sigma_m_s2 / o.gravity_m_s2;
  EXPECT_NEAR(std::sqrt(p(error_at::kGravityTilt, error_at::kGravityTilt)), by_bias, 0.02 * by_bias);
  const auto correlation = [&](int i, int j) { return p(i, j) / std::sqrt(p(i, i) * p(j, j)); };
  EXPECT_GT(std::abs(correlation(error_at::kGravityTilt, error_at::kAccelBias + 1)), 0.99);
  EXPECT_GT(std::abs(correlation(error_at::kGravityTilt + 1, error_at::kAccelBias)), 0.99);
  EXPECT_LT(std::abs(correlation(error_at::kGravityTilt, error_at::kAccelBias)), 0.05);
  // The pose defines the world and stays exact.
  EXPECT_LT(p.diagonal().head<6>().maxCoeff(), 1e-11);
}

TEST(ErrorStateFilter, StaticReadingsEstimateTheGyroBias) {
  const LocalizationOptions o = test_options();
  const ErrorStateFilter filter = started(o, {true, false, false, false});
  Random random(71, 77);
  const Eigen::Vector3d bias = normal3(random, 5e-5);  // as test_samples draws it
  const double sigma = std::sqrt(filter.memory().estimate.covariance(error_at::kGyroBias, error_at::kGyroBias));
  EXPECT_LT(sigma, o.imu.gyro_noise_rad_s_sqrt_hz / std::sqrt(2.0));
  EXPECT_LE((filter.memory().estimate.state.gyro_bias_rad_s - bias).cwiseAbs().maxCoeff(), 4 * sigma);
}

// Motions with the same error D z each.
std::vector<Measurement> drifting_motions(const TestDrive& drive, double seconds, const Vector6d& z) {
  std::vector<Measurement> motions = test_motions(drive, seconds, 0.3, 5);
  for (Measurement& m : motions) {
    auto& motion = std::get<RelativeMotion>(m);
    const Vector6d off = motion.covariance.diagonal().cwiseSqrt().cwiseProduct(z);
    motion.previous_from_current = motion.previous_from_current * exp_se3(-off);
  }
  return motions;
}

TEST(ErrorStateFilter, DriftOfVisionIsEstimated) {
  LocalizationOptions o = test_options();
  o.vision.constant_sigma_ratios = {1, 1, 1, 1, 1, 1};
  const TestSensors with{true, false, false, true, 0.1};
  const TestDrive drive;
  Vector6d z;
  z << 0.5, -0.5, 0.3, 1, -1, 0.5;
  ErrorStateFilter filter(o);
  filter.start(test_stamp(2.5), Eigen::Vector3d::UnitX(), test_samples(drive, 2.5, with, 71));
  for (const Measurement& m : in_order(test_samples(drive, 300, with, 71), drifting_motions(drive, 300, z))) {
    if (stamp_of_measurement(m) > test_stamp(2.5)) filter.process(m);
  }
  const StateEstimate& estimate = filter.memory().estimate;
  for (int i = 3; i < 5; ++i) {
    const int at = error_at::kVisionConstant + i;
    const double sigma = std::sqrt(estimate.covariance(at, at));
    EXPECT_LT(sigma, 0.5) << "roll and pitch are observable by gravity";
    EXPECT_LT(std::abs(estimate.state.vision_constant[i] - z[i]), 3 * sigma) << i;
  }
}

TEST(ErrorStateFilter, MapConstraintsDoNotUpdateTheDriftOfVision) {
  LocalizationOptions o = test_options();
  o.vision.constant_sigma_ratios = {1, 1, 1, 1, 1, 1};
  ErrorStateFilter filter = started(o, {false, false, false, false});
  for (const Measurement& m : test_motions(TestDrive(), 60, 1, 3)) filter.process(m);
  const NavigationState before = filter.memory().estimate.state;
  const Pose off = Pose::from_translation({0.002, 0, 0});
  filter.process(PoseConstraint{filter.memory().stamp, before.world_from_body * off, 1e8 * Matrix6d::Identity()});
  const NavigationState& after = filter.memory().estimate.state;
  EXPECT_GT((after.world_from_body.translation() - before.world_from_body.translation()).norm(), 1e-3);
  EXPECT_EQ(after.vision_constant, before.vision_constant);
  EXPECT_EQ(after.vision_drift, before.vision_drift);
}

TEST(ErrorStateFilter, LargeTiltInnovationBetweenFramesInflatesTheAttitude) {
  const TestDrive drive;
  const auto health_after = [&](double seconds) {
    ErrorStateFilter filter = started(test_options(), {false, false, false, true, 0});
    for (const Measurement& m : test_motions(drive, 31, 0, 3)) filter.process(m);
    const double t = seconds_between(test_stamp(0), filter.memory().stamp) + seconds;
    const Eigen::Vector3d up = drive.at(t).rotation().conjugate() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector2d tilt = roll_pitch_of_up(up);
    filter.process(InclinometerSample{test_stamp(t), tilt.x() + 0.06, tilt.y(), 0.0035});
    return filter.memory().monitors[static_cast<std::size_t>(LocalizationSensor::inclinometer)].state;
  };
  EXPECT_EQ(health_after(0.02), SensorState::suspect) << "right after a frame the attitude is known";
  EXPECT_EQ(health_after(1.4), SensorState::ok);
}

TEST(ErrorStateFilter, VerticalIsUncertainWithoutReadingsAtTheStart) {
  const ErrorStateFilter filter = started(test_options(), {false, false, false, false});
  EXPECT_FALSE(filter.memory().gravity_measured);
  EXPECT_GT(filter.memory().estimate.covariance(error_at::kGravityTilt, error_at::kGravityTilt), 0.1);
}

}  // namespace
}  // namespace spartan::internal
