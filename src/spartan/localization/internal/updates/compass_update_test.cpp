#include "spartan/localization/internal/updates/compass_update.h"

#include <gtest/gtest.h>

#include <cmath>

#include "spartan/localization/internal/updates/started_memory_test.h"

namespace spartan::internal {
namespace {

constexpr double kSigma_rad = 0.02;

// The pose is exact, the heading of the world was measured, gravity is known.
FilterMemory with_offset(const LocalizationOptions& options, double offset_sigma) {
  FilterMemory memory = started_memory(options, {true, false, true, false});
  memory.estimate.covariance.diagonal().segment<2>(error_at::kGravityTilt).setZero();
  memory.estimate.covariance(error_at::kCompassOffset, error_at::kCompassOffset) = offset_sigma * offset_sigma;
  memory.estimate.state.compass_offset_rad = 0;
  return memory;
}

TEST(CompassUpdate, EstimatesItsOffset) {
  const LocalizationOptions options = test_options();
  FilterMemory memory = with_offset(options, 0.03);
  const Pose before = odom_pose(memory);
  CompassUpdate(options).update(memory, {start_stamp(), 0.01, kSigma_rad});
  const double prior = 0.03 * 0.03, noise = kSigma_rad * kSigma_rad;
  EXPECT_NEAR(memory.estimate.state.compass_offset_rad, 0.01 * prior / (prior + noise), 1e-6);
  EXPECT_NEAR(variance_at(memory, error_at::kCompassOffset), prior * noise / (prior + noise), 1e-9);
  EXPECT_LT(distance(odom_pose(memory), before), 1e-12);
}

TEST(CompassUpdate, RejectsBursts) {
  const LocalizationOptions options = test_options();
  FilterMemory memory = with_offset(options, 0.003);
  const ErrorCovariance before = memory.estimate.covariance;
  CompassUpdate(options).update(memory, {start_stamp(), 0.7, kSigma_rad});
  EXPECT_EQ(memory.estimate.state.compass_offset_rad, 0);
  EXPECT_EQ(memory.estimate.covariance, before);
  EXPECT_EQ(memory.monitor(LocalizationSensor::compass).state, SensorState::suspect);
}

TEST(CompassUpdate, ReadmitsACompassWhoseOffsetHasChanged) {
  const LocalizationOptions options = test_options();
  FilterMemory memory = with_offset(options, 0.003);
  int readings = 0;
  do {
    CompassUpdate(options).update(memory, {start_stamp(), 0.7, kSigma_rad});
    ++readings;
  } while (memory.monitor(LocalizationSensor::compass).state != SensorState::ok && readings < 100);
  EXPECT_GT(readings, 20);
  EXPECT_LT(readings, 60);
  EXPECT_NEAR(memory.estimate.state.compass_offset_rad, 0.7, 0.05);
}

TEST(CompassUpdate, OffsetOfALateCompassIsTheConsensusOfItsFirstReadings) {
  const LocalizationOptions options = test_options();
  FilterMemory memory = started_memory(options, {true, false, false, false});
  const CompassUpdate compass(options);
  for (const double reading : {1.001, 1.7, 0.999, 1.000}) compass.update(memory, {start_stamp(), reading, kSigma_rad});
  EXPECT_FALSE(memory.compass.offset_known);
  compass.update(memory, {start_stamp(), 1.000, kSigma_rad});
  EXPECT_TRUE(memory.compass.offset_known);
  EXPECT_NEAR(memory.estimate.state.compass_offset_rad, 1.0, 2e-3);
}

}  // namespace
}  // namespace spartan::internal
