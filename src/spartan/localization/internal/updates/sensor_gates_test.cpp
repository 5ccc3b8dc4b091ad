#include "spartan/localization/internal/updates/sensor_gates.h"

#include <gtest/gtest.h>

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
  SensorMonitor monitor;
  const auto passes = [&](double nis) { return gates.accept(monitor, nis, 1, HealthReason::disagrees); };
  EXPECT_TRUE(passes(gates.limit(1)));
  EXPECT_FALSE(passes(1.01 * gates.limit(1)));
  EXPECT_EQ(monitor.state, SensorState::suspect);
  EXPECT_FALSE(gates.accept_within(monitor, 3, 2, HealthReason::slips));
  EXPECT_EQ(monitor.state, SensorState::excluded);
  EXPECT_EQ(monitor.reason, HealthReason::slips);
  EXPECT_FALSE(passes(1));
  EXPECT_FALSE(passes(1));
  EXPECT_TRUE(passes(1));
  EXPECT_EQ(monitor.state, SensorState::ok);
}

}  // namespace
}  // namespace spartan::internal
