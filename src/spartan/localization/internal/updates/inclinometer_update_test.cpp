#include "spartan/localization/internal/updates/inclinometer_update.h"

#include <gtest/gtest.h>

#include <cmath>

#include "spartan/localization/internal/updates/started_memory_test.h"

namespace spartan::internal {
namespace {

TEST(InclinometerUpdate, FirstReadingGivesTheVertical) {
  const LocalizationOptions options = test_options();
  FilterMemory memory = started_memory(options, {false, false, false, false});
  ASSERT_FALSE(memory.gravity_known);
  InclinometerUpdate(options).update(memory, {start_stamp(), 0.7, -0.5, 0.003});
  EXPECT_TRUE(memory.gravity_known);
  const Eigen::Vector3d up = true_up(memory.estimate.state.gravity_tilt_rad);
  EXPECT_LT((memory.estimate.state.world_from_body.rotation().conjugate() * up - up_of_roll_pitch(0.7, -0.5)).norm(),
            1e-6);
}

TEST(InclinometerUpdate, EstimatesItsBias) {
  LocalizationOptions options = test_options();
  options.inclinometer.bias_sigma_rad = 0.004;
  FilterMemory memory = started_memory(options, {true, false, false, false});
  memory.estimate.covariance.diagonal().segment<2>(error_at::kGravityTilt).setZero();
  memory.estimate.covariance.middleRows<2>(error_at::kGravityTilt).setZero();
  memory.estimate.covariance.middleCols<2>(error_at::kGravityTilt).setZero();
  const double roll = 0.004;
  InclinometerUpdate(options).update(memory, {start_stamp(), roll, 0, 0.003});
  const double prior = std::pow(options.inclinometer.bias_sigma_rad, 2), noise = 0.003 * 0.003;
  EXPECT_NEAR(memory.estimate.state.inclinometer_bias_rad.x(), roll * prior / (prior + noise), 1e-6);
  EXPECT_NEAR(variance_at(memory, error_at::kInclinometerBias), prior * noise / (prior + noise), 1e-10);
}

// Wheels drop from rocks: between frames, without an IMU, the noise of the attitude takes a large innovation.
TEST(InclinometerUpdate, RockingBetweenFramesIsNoFault) {
  const LocalizationOptions options = test_options();
  for (const bool between_frames : {false, true}) {
    FilterMemory memory = started_memory(options, {false, false, false, true});
    if (between_frames) StatePropagation(options).propagate_to(memory, after_start(1), nullptr);
    const double before = variance_at(memory, error_at::kAttitude);
    InclinometerUpdate(options).update(memory, {memory.stamp, 0.03, 0, 0.003});
    const bool ok = memory.monitor(LocalizationSensor::inclinometer).state == SensorState::ok;
    EXPECT_EQ(ok, between_frames);
    const double roll = log_so3(memory.estimate.state.world_from_body.rotation()).x();
    if (between_frames) {
      EXPECT_GT(roll, 0.015);
      EXPECT_GT(variance_at(memory, error_at::kAttitude), 0.1 * before);
    } else {
      EXPECT_EQ(roll, 0);
    }
  }
}

TEST(InclinometerUpdate, ReadmitsOneWhoseBiasHasChanged) {
  const LocalizationOptions options = test_options();
  FilterMemory memory = started_memory(options, {true, false, false, true});
  int readings = 0;
  do {
    InclinometerUpdate(options).update(memory, {start_stamp(), 0.2, 0, 0.003});
    ++readings;
  } while (memory.monitor(LocalizationSensor::inclinometer).state != SensorState::ok && readings < 100);
  EXPECT_GT(readings, 20);
  EXPECT_LT(readings, 80);
  EXPECT_NEAR(memory.estimate.state.inclinometer_bias_rad.x(), 0.2, 0.01);
}

}  // namespace
}  // namespace spartan::internal
