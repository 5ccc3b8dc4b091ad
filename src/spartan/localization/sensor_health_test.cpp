#include "spartan/localization/sensor_health.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace spartan {
namespace {

bool judge(SensorJudge& judge, double square) {
  return judge.judge(square, 10, HealthReason::disagrees, 3, 5);
}

TEST(SensorJudge, GoesFromOkOverSuspectToExcludedAndBack) {
  SensorJudge j;
  EXPECT_TRUE(judge(j, 1));
  EXPECT_FALSE(judge(j, 11));
  EXPECT_EQ(j.state, SensorState::suspect);
  EXPECT_TRUE(judge(j, 1));  // one outlier is forgiven
  EXPECT_EQ(j.state, SensorState::ok);
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(judge(j, 50));
  EXPECT_EQ(j.state, SensorState::excluded);
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(judge(j, 1)) << "not yet";
  EXPECT_FALSE(judge(j, 50));  // counting starts again
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(judge(j, 1));
  EXPECT_TRUE(judge(j, 1));
  EXPECT_EQ(j.state, SensorState::ok);
  EXPECT_EQ(j.used, 3);
  EXPECT_EQ(j.rejected, 13);
}

TEST(SensorJudge, NanFails) {
  SensorJudge j;
  EXPECT_FALSE(judge(j, std::numeric_limits<double>::quiet_NaN()));
}

TEST(SensorJudge, ReportsWithReason) {
  SensorJudge j;
  const Stamp now{5'000'000'000};
  EXPECT_EQ(j.report(now, 1, {}).state, SensorState::missing);
  EXPECT_THAT(j.report(now, 1, {}).reason, ::testing::HasSubstr("not said"));
  j.see({4'500'000'000});
  EXPECT_EQ(j.report(now, 1, {}).state, SensorState::ok);
  EXPECT_EQ(j.report(now, 1, {}).reason, "");
  EXPECT_THAT(j.report({9'000'000'000}, 1, {}).reason, ::testing::HasSubstr("silent for 4.5 s"));
  judge(j, 77);
  EXPECT_THAT(j.report(now, 1, {}).reason, ::testing::HasSubstr("77.0, at most 10.0"));
  RefusalCounts refusals;
  refusals.count(Refusal::not_finite);
  refusals.count(Refusal::too_late);
  refusals.count(Refusal::too_late);
  const SensorHealth health = j.report(now, 1, refusals);
  EXPECT_EQ(health.refused.not_finite, 1);
  EXPECT_EQ(health.refused.too_late, 2);
  EXPECT_EQ(health.rejected, 1);
}

TEST(SensorHealth, NamesAreThoseOfTheFormat) {
  EXPECT_EQ(name_of(SensorState::ok), "ok");
  EXPECT_EQ(name_of(SensorState::suspect), "suspect");
  EXPECT_EQ(name_of(SensorState::excluded), "excluded");
  EXPECT_EQ(name_of(SensorState::missing), "missing");
}

}  // namespace
}  // namespace spartan
