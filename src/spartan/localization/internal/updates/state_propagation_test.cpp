#include "spartan/localization/internal/updates/state_propagation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "spartan/localization/internal/updates/started_memory_test.h"

namespace spartan::internal {
namespace {

TEST(StatePropagation, HoldsTheLastReadingUpToTheTimeout) {
  const LocalizationOptions options = test_options();
  const StatePropagation propagation(options);
  FilterMemory memory = started_memory(options, {true, false, false, false});
  memory.imu.last.gyro_rad_s = {0, 0, 0.2};
  propagation.propagate_to(memory, after_start(0.2), nullptr);
  EXPECT_NEAR(log_so3(memory.estimate.state.world_from_body.rotation()).z(), 0.04, 1e-9);
  EXPECT_EQ(memory.vision.constant_velocity_s, 0);
  propagation.propagate_to(memory, after_start(0.3), nullptr);  // the reading is 0.3 s old
  EXPECT_DOUBLE_EQ(memory.vision.constant_velocity_s, 0.1);
  EXPECT_EQ(memory.stamp, after_start(0.3));
}

TEST(StatePropagation, InterpolatesTowardsTheNextReading) {
  const LocalizationOptions options = test_options();
  FilterMemory memory = started_memory(options, {true, false, false, false});
  memory.imu.last.gyro_rad_s = {0, 0, 0.1};
  ImuSample next = memory.imu.last;
  next.stamp = after_start(0.1);
  next.gyro_rad_s = {0, 0, 0.3};
  StatePropagation(options).propagate_to(memory, after_start(0.05), &next);
  // From 0.1 to 0.2 rad/s in half of the time.
  EXPECT_NEAR(log_so3(memory.estimate.state.world_from_body.rotation()).z(), 0.05 * 0.15, 1e-9);
}

TEST(StatePropagation, NeverGoesBack) {
  const LocalizationOptions options = test_options();
  FilterMemory memory = started_memory(options, {true, false, false, false});
  const ErrorCovariance before = memory.estimate.covariance;
  StatePropagation(options).propagate_to(memory, after_start(-0.1), nullptr);
  EXPECT_EQ(memory.stamp, start_stamp());
  EXPECT_EQ(memory.estimate.covariance, before);
}

// σ t of the attitude, whatever the steps.
TEST(StatePropagation, AttitudeOfARockingRoverGrowsWithTime) {
  const LocalizationOptions options = test_options();
  const StatePropagation propagation(options);
  for (const int steps : {1, 20}) {
    FilterMemory memory = started_memory(options, {false, false, false, false});
    for (int i = 1; i <= steps; ++i) propagation.propagate_to(memory, after_start(2.0 * i / steps), nullptr);
    const double sigma = options.constant_velocity.rate_sigma_ratio * options.constant_velocity.rate_offset_rad_s * 2;
    EXPECT_NEAR(std::sqrt(variance_at(memory, error_at::kAttitude)), sigma, 1e-3 * sigma) << steps;
  }
}

TEST(StatePropagation, BiasesWalk) {
  LocalizationOptions options = test_options();
  options.wheels.scale_sigma = 0.1;
  const StatePropagation propagation(options);
  FilterMemory memory = started_memory(options, {false, false, false, false});
  const double scale = variance_at(memory, error_at::kWheelScale),
               tilt = variance_at(memory, error_at::kInclinometerBias),
               compass = variance_at(memory, error_at::kCompassOffset);
  propagation.propagate_to(memory, after_start(9), nullptr);
  EXPECT_EQ(variance_at(memory, error_at::kWheelScale), scale) << "no more than its prior";
  EXPECT_NEAR(variance_at(memory, error_at::kInclinometerBias) - tilt,
              9 * std::pow(options.inclinometer.bias_walk_rad_per_sqrt_s, 2), 1e-15);
  EXPECT_NEAR(variance_at(memory, error_at::kCompassOffset) - compass,
              9 * std::pow(options.compass.offset_walk_rad_per_sqrt_s, 2), 1e-12);
  memory.estimate.covariance(error_at::kWheelScale, error_at::kWheelScale) = 1e-4;
  propagation.propagate_to(memory, after_start(13), nullptr);
  EXPECT_NEAR(variance_at(memory, error_at::kWheelScale), 1e-4 + 4 * std::pow(options.wheels.scale_walk_per_sqrt_s, 2),
              1e-12);
}

}  // namespace
}  // namespace spartan::internal
