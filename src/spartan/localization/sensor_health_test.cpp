#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "spartan/localization/localizer.h"

namespace spartan {
namespace {

bool accept(SensorMonitor& monitor, double nis) {
  return monitor.accept(nis, 10, HealthReason::disagrees, 3, 5);
}

TEST(SensorMonitor, GoesFromOkViaSuspectToExcludedAndBack) {
  SensorMonitor j;
  EXPECT_TRUE(accept(j, 1));
  EXPECT_FALSE(accept(j, 11));
  EXPECT_EQ(j.state, SensorState::suspect);
  EXPECT_TRUE(accept(j, 1));  // readmitted after one outlier
  EXPECT_EQ(j.state, SensorState::ok);
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(accept(j, 50));
  EXPECT_EQ(j.state, SensorState::excluded);
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(accept(j, 1)) << "not yet";
  EXPECT_FALSE(accept(j, 50));  // the count restarts
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(accept(j, 1));
  EXPECT_TRUE(accept(j, 1));
  EXPECT_EQ(j.state, SensorState::ok);
  EXPECT_EQ(j.used, 3);
  EXPECT_EQ(j.rejected, 13);
}

TEST(SensorMonitor, NanFails) {
  SensorMonitor j;
  EXPECT_FALSE(accept(j, std::numeric_limits<double>::quiet_NaN()));
}

TEST(SensorMonitor, ReportsTheReason) {
  SensorMonitor j;
  const Stamp now{5'000'000'000};
  EXPECT_EQ(j.report(now, 1, {}).state, SensorState::missing);
  EXPECT_THAT(j.report(now, 1, {}).reason, ::testing::HasSubstr("no measurement received"));
  j.see({4'500'000'000});
  EXPECT_EQ(j.report(now, 1, {}).state, SensorState::ok);
  EXPECT_EQ(j.report(now, 1, {}).reason, "");
  EXPECT_THAT(j.report({9'000'000'000}, 1, {}).reason, ::testing::HasSubstr("no measurement for 4.5 s"));
  accept(j, 77);
  EXPECT_THAT(j.report(now, 1, {}).reason, ::testing::HasSubstr("NIS 77.0 above the chi-square gate of 10.0"));
  RefusalCounts refusals;
  refusals.count(Refusal::not_finite);
  refusals.count(Refusal::too_late);
  refusals.count(Refusal::too_late);
  const SensorHealth health = j.report(now, 1, refusals);
  EXPECT_EQ(health.refused.not_finite, 1);
  EXPECT_EQ(health.refused.too_late, 2);
  EXPECT_EQ(health.rejected, 1);
}

TEST(SensorHealth, NamesMatchTheFileFormat) {
  EXPECT_EQ(name_of(SensorState::ok), "ok");
  EXPECT_EQ(name_of(SensorState::suspect), "suspect");
  EXPECT_EQ(name_of(SensorState::excluded), "excluded");
  EXPECT_EQ(name_of(SensorState::missing), "missing");
}

}  // namespace
}  // namespace spartan
