#include "spartan/localization/internal/updates/sensor_gates.h"

#include <gtest/gtest.h>

#include <limits>

namespace spartan::internal {
namespace {

TEST(SensorGates, LimitsAreThoseOfTheChiSquareDistribution) {
  LocalizationOptions options;
  options.health.gate_probability = 0.999;
  options.vision.gate_probability = 0.999;
  const SensorGates gates(options);
  EXPECT_NEAR(gates.limit(1), 10.828, 1e-3);
  EXPECT_NEAR(gates.limit(6), 22.458, 1e-3);
  EXPECT_NEAR(gates.limits().vision, 22.458, 1e-3);
}

TEST(SensorGates, ExcludesAndReadmits) {
  LocalizationOptions options;
  options.health.excluded_after = 2;
  options.health.readmit_after = 3;
  const SensorGates gates(options);
  FilterMemory memory;
  memory.stamp = {5};
  constexpr LocalizationSensor kCompass = LocalizationSensor::compass;
  const SensorMonitor& monitor = memory.monitor(kCompass);
  const auto passes = [&](double nis) { return gates.accept(memory, kCompass, nis, 1, HealthReason::disagrees); };
  EXPECT_TRUE(passes(gates.limit(1)));
  EXPECT_FALSE(passes(1.01 * gates.limit(1)));
  EXPECT_EQ(monitor.state, SensorState::suspect);
  EXPECT_FALSE(gates.accept_within(memory, kCompass, 3, 2, HealthReason::slips));
  EXPECT_EQ(monitor.state, SensorState::excluded);
  EXPECT_EQ(monitor.reason, HealthReason::slips);
  EXPECT_FALSE(passes(1));
  EXPECT_FALSE(passes(1));
  EXPECT_TRUE(passes(1));
  EXPECT_EQ(monitor.state, SensorState::ok);
}

TEST(SensorGates, TheLastTestIsKept) {
  constexpr LocalizationSensor kWheels = LocalizationSensor::wheels;
  const SensorGates gates{LocalizationOptions()};
  FilterMemory memory;
  const SensorMonitor& monitor = memory.monitor(kWheels);
  EXPECT_FALSE(monitor.test);
  memory.stamp = {7};
  gates.accept(memory, kWheels, 2.5, 3, HealthReason::disagrees);
  ASSERT_TRUE(monitor.test);
  EXPECT_EQ(monitor.test->stamp, Stamp{7});
  EXPECT_EQ(monitor.test->nis, 2.5);
  EXPECT_EQ(monitor.test->gate, gates.limit(3));
  // Of a singular covariance: the state that is saved has finite numbers only.
  for (const double nis : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_FALSE(gates.accept_within(memory, kWheels, nis, 4, HealthReason::disagrees));
    EXPECT_EQ(monitor.test->nis, std::numeric_limits<double>::max());
    EXPECT_EQ(monitor.nis, std::numeric_limits<double>::max());
  }
  const SensorMonitor& vision = memory.monitor(LocalizationSensor::vision);
  const MotionDecision reset{MotionUse::reset, false, false, 0, 30, HealthReason::none};  // the IMU has failed
  EXPECT_TRUE(gates.accept_motion(memory, reset, 50));
  ASSERT_TRUE(vision.test);
  EXPECT_EQ(vision.test->nis, 50);
  EXPECT_EQ(vision.test->gate, gates.limits().vision);
  EXPECT_TRUE(gates.accept_motion(memory, {MotionUse::follow, false, false, 0, 30, HealthReason::none}, {}));
  EXPECT_FALSE(vision.test);
}

}  // namespace
}  // namespace spartan::internal
