#include "spartan/localization/internal/updates/imu_update.h"

#include <gtest/gtest.h>

#include "spartan/localization/internal/updates/started_memory_test.h"

namespace spartan::internal {
namespace {

ImuSample reading(double seconds, double rate_z = 0) {
  ImuSample sample = TestDrive().imu(2.5 + seconds);
  sample.stamp = after_start(seconds);
  sample.gyro_rad_s = {0, 0, rate_z};
  return sample;
}

LocalizationOptions with_clock(double sigma_s) {
  LocalizationOptions options = test_options();
  options.imu.time_offset_sigma_s = sigma_s;
  return options;
}

TEST(ImuUpdate, SamplesWaitForAsLongAsTheClockMayBeOff) {
  for (const double sigma_s : {0.0, 0.02}) {
    const LocalizationOptions options = with_clock(sigma_s);
    const ImuUpdate imu(options);
    FilterMemory memory = started_memory(options, {true, false, false, false});
    for (int i = 1; i <= 20; ++i) imu.add(memory, reading(0.01 * i));
    EXPECT_NEAR(seconds_between(memory.stamp, after_start(0.2)), options.imu.max_time_error_s(), 1e-9) << sigma_s;
    imu.advance_to(memory, after_start(0.2));
    EXPECT_EQ(memory.stamp, after_start(0.2));
  }
}

// Stamps of the IMU are late by the offset: the turn that begins at 0.1 s by its clock has begun before.
TEST(ImuUpdate, UsesTheClockOfTheCameras) {
  const LocalizationOptions options = with_clock(0.02);
  const ImuUpdate imu(options);
  const auto heading = [&](double offset_s) {
    FilterMemory memory = started_memory(options, {true, false, false, false});
    memory.estimate.state.imu_time_offset_s = offset_s;
    for (int i = 1; i <= 40; ++i) imu.add(memory, reading(0.01 * i, i >= 10 ? 0.5 : 0));
    imu.advance_to(memory, after_start(0.2));
    return log_so3(memory.estimate.state.world_from_body.rotation()).z();
  };
  EXPECT_NEAR(heading(0.03) - heading(0), 0.5 * 0.03, 1e-6);
}

TEST(ImuUpdate, ExcludesImpossibleReadings) {
  const LocalizationOptions options = with_clock(0);
  const ImuUpdate imu(options);
  FilterMemory memory = started_memory(options, {true, false, false, false});
  ImuSample broken = reading(0.01);
  broken.accel_m_s2.x() = 500;
  imu.add(memory, broken);
  const SensorMonitor& monitor = memory.monitor(LocalizationSensor::imu);
  EXPECT_EQ(monitor.state, SensorState::excluded);
  EXPECT_EQ(monitor.reason, HealthReason::out_of_range);
  for (int i = 0; i < options.health.readmit_after; ++i) {
    EXPECT_EQ(monitor.state, SensorState::excluded);
    imu.add(memory, reading(0.02 + 0.01 * i, 1e-4 * i));
  }
  EXPECT_EQ(monitor.state, SensorState::ok);
}

TEST(ImuUpdate, ExcludesAFrozenSensor) {
  const LocalizationOptions options = with_clock(0);
  const ImuUpdate imu(options);
  FilterMemory memory = started_memory(options, {true, false, false, false});
  const ImuSample frozen = reading(0.01, 0.01);
  for (int i = 1; i <= 40; ++i) {
    ImuSample sample = frozen;
    sample.stamp = after_start(0.01 * i);
    imu.add(memory, sample);
  }
  EXPECT_TRUE(memory.inertial_usable());
  for (int i = 41; i <= 60; ++i) {
    ImuSample sample = frozen;
    sample.stamp = after_start(0.01 * i);
    imu.add(memory, sample);
  }
  EXPECT_FALSE(memory.inertial_usable());
  EXPECT_EQ(memory.monitor(LocalizationSensor::imu).reason, HealthReason::frozen);
}

}  // namespace
}  // namespace spartan::internal
