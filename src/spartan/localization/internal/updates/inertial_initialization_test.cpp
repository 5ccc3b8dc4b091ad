#include "spartan/localization/internal/updates/inertial_initialization.h"

#include <gtest/gtest.h>

#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/internal/updates/started_memory_test.h"

namespace spartan::internal {
namespace {

InertialAlignment found() {
  InertialAlignment a;
  a.gyro_bias_rad_s = {0.01, -0.02, 0.03};
  a.accel_bias_m_s2 = {0.1, 0.2, -0.1};
  a.velocity_m_s = {0.06, 0, 0.01};
  a.up = up_of_roll_pitch(0.1, -0.2);
  a.time_offset_s = 0.015;
  a.covariance.setZero();
  a.covariance.diagonal() << Eigen::Vector3d::Constant(1e-6), Eigen::Vector3d::Constant(1e-4),
      Eigen::Vector3d::Constant(1e-5), Eigen::Vector3d::Constant(4e-6), 1e-6;
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - a.up * a.up.transpose();
  a.covariance.block<3, 3>(9, 9) = across * a.covariance.block<3, 3>(9, 9) * across;
  return a;
}

TEST(InertialInitialization, TakesOverWhatTheAlignmentFound) {
  FilterMemory memory = started_memory(test_options(), {false, false, false, false});
  memory.monitor(LocalizationSensor::imu).exclude(HealthReason::contradicted);
  ASSERT_FALSE(memory.gravity_known);
  const InertialAlignment a = found();
  take_over(memory, a);
  const NavigationState& s = memory.estimate.state;
  EXPECT_TRUE(memory.imu.aligned && memory.gravity_known);
  EXPECT_EQ(memory.monitor(LocalizationSensor::imu).state, SensorState::ok);
  EXPECT_LT((s.gyro_bias_rad_s - a.gyro_bias_rad_s).norm(), 1e-9);
  EXPECT_LT((s.velocity_m_s - a.velocity_m_s).norm(), 1e-9);
  EXPECT_NEAR(s.imu_time_offset_s, 0.015, 1e-12);
  EXPECT_LT((up_in_body(s, error_at::kPose).up - a.up).norm(), 1e-6);
  EXPECT_NEAR(variance_at(memory, error_at::kGyroBias), 1e-6, 1e-9);
  EXPECT_NEAR(variance_at(memory, error_at::kVelocity), 1e-5, 1e-9);
  // The first pose defines the world: the tilt of gravity is as uncertain as up in the body.
  EXPECT_NEAR(variance_at(memory, error_at::kGravityTilt), 4e-6, 1e-6);
}

// Biases and the vertical share their error: an accelerometer bias looks like a tilt.
TEST(InertialInitialization, KeepsTheCorrelationOfBiasAndVertical) {
  InertialAlignment a = found();
  a.up = Eigen::Vector3d::UnitZ();
  a.covariance.block<3, 3>(9, 9) = Eigen::Vector3d(4e-6, 4e-6, 0).asDiagonal();
  a.covariance(9, 3) = a.covariance(3, 9) = 1.9e-5;  // of σ 2e-3 and 1e-2: 0.95
  FilterMemory memory = started_memory(test_options(), {false, false, false, false});
  take_over(memory, a);
  const auto& p = memory.estimate.covariance;
  const auto correlation = [&](int i, int j) { return p(i, j) / std::sqrt(p(i, i) * p(j, j)); };
  EXPECT_GT(std::abs(correlation(error_at::kAccelBias, error_at::kGravityTilt + 1)), 0.9);
  EXPECT_LT(std::abs(correlation(error_at::kAccelBias, error_at::kGravityTilt)), 0.05);
}

// On a slope of 0.15 rad, without motions that would align it.
TEST(InertialInitialization, LevelsAtOnceAndIsSuspectAfterAWhile) {
  const LocalizationOptions options = test_options();
  FilterMemory memory = started_memory(options, {false, false, false, false});
  memory.imu.known = true;
  memory.imu.level_from = memory.imu.waiting_since = start_stamp();
  memory.imu.window.begin(start_stamp());
  const InertialInitialization initialization(options);
  const Eigen::Vector3d up = up_of_roll_pitch(0, 0.15);
  const auto add_until = [&](double from_s, double to_s) {
    for (double t = from_s; t < to_s; t += 0.01) {
      const ImuSample sample{after_start(t), Eigen::Vector3d::Zero(), options.gravity_m_s2 * up};
      initialization.add(memory, sample);
      memory.imu.last = sample;
    }
  };
  memory.imu.last = {start_stamp(), Eigen::Vector3d::Zero(), options.gravity_m_s2 * up};
  add_until(0.01, 0.9);
  EXPECT_FALSE(memory.gravity_known);
  add_until(0.9, 1.2);
  EXPECT_TRUE(memory.gravity_known);
  EXPECT_LT((up_in_body(memory.estimate.state, error_at::kPose).up - up).norm(), 1e-3);
  EXPECT_FALSE(memory.imu.aligned);
}

}  // namespace
}  // namespace spartan::internal
