#include "spartan/localization/internal/updates/zero_velocity_update.h"

#include <gtest/gtest.h>

#include <cmath>

#include "spartan/localization/internal/updates/imu_update.h"
#include "spartan/localization/internal/updates/started_memory_test.h"
#include "spartan/localization/internal/updates/wheel_update.h"

namespace spartan::internal {
namespace {

struct Rest {
  double shaking_m_s2 = 0, turning_rad_s = 0, rolling_m_s = 0;
  bool wheels = true;
  bool vision_stationary = false;
};

// A rover that rests for a while after the start, by ideal sensors; the samples pass through ImuUpdate, which owns the
// zero-velocity update.
FilterMemory after_rest(const LocalizationOptions& options, const Rest& rest, double seconds) {
  FilterMemory memory = started_memory(options, {true, rest.wheels, false, false});
  memory.vision.stationary = rest.vision_stationary;
  const ImuUpdate imu(options);
  const WheelUpdate wheels(options);
  const ImuSample still = memory.imu.last;
  for (int i = 1; i <= static_cast<int>(seconds * 100); ++i) {
    const Stamp stamp = after_start(0.01 * i);
    ImuSample sample = still;
    sample.stamp = stamp;
    sample.gyro_rad_s.x() += 1e-6 * (i % 3);  // readings that never change are those of a broken sensor
    sample.gyro_rad_s.z() += rest.turning_rad_s;
    sample.accel_m_s2.x() += i % 2 == 0 ? rest.shaking_m_s2 : -rest.shaking_m_s2;
    imu.add(memory, sample);
    if (!rest.wheels || i % 5 != 0) continue;
    imu.advance_to(memory, stamp);
    memory.monitor(LocalizationSensor::wheels).see(stamp);
    wheels.update(memory, {stamp, 0.01 * i * rest.rolling_m_s, 0.01 * i * rest.rolling_m_s});
  }
  return memory;
}

LocalizationOptions exact_clock() {
  LocalizationOptions options = test_options();
  options.imu.time_offset_sigma_s = 0;
  return options;
}

TEST(ZeroVelocityUpdate, HoldsAStationaryRover) {
  LocalizationOptions options = exact_clock();
  const FilterMemory held = after_rest(options, {}, 10);
  EXPECT_TRUE(held.step.stationary);
  options.zero_velocity.enabled = false;
  const FilterMemory drifting = after_rest(options, {}, 10);
  EXPECT_FALSE(drifting.step.stationary);
  const double sigma = options.zero_velocity.position_sigma_m;
  EXPECT_LT(std::sqrt(variance_at(held, error_at::kPosition)), sigma);
  EXPECT_GT(std::sqrt(variance_at(drifting, error_at::kPosition)), 5 * sigma);
  EXPECT_LT(held.estimate.state.world_from_body.translation().norm(), 1e-4);
}

TEST(ZeroVelocityUpdate, NeedsTheImuAndAnotherSensor) {
  const LocalizationOptions options = exact_clock();
  EXPECT_TRUE(after_rest(options, {.wheels = false, .vision_stationary = true}, 2).step.stationary);
  EXPECT_FALSE(after_rest(options, {.wheels = false, .vision_stationary = false}, 2).step.stationary);
  EXPECT_FALSE(after_rest(options, {.rolling_m_s = 0.05}, 2).step.stationary) << "a smooth drive";
  EXPECT_FALSE(after_rest(options, {.turning_rad_s = 0.05}, 2).step.stationary) << "a slide";
  EXPECT_FALSE(after_rest(options, {.shaking_m_s2 = 0.5}, 2).step.stationary);
}

}  // namespace
}  // namespace spartan::internal
