#include "spartan/localization/internal/updates/motion_plausibility.h"

#include <gtest/gtest.h>

#include "spartan/localization/internal/drive_test.h"

namespace spartan::internal {
namespace {

RelativeMotion forward(double from_s, double to_s, double metres) {
  RelativeMotion m;
  m.from = test_stamp(from_s);
  m.to = test_stamp(to_s);
  m.previous_from_current = Pose::from_translation({metres, 0, 0});
  return m;
}

RecentMotion after_motions(int count) {
  RecentMotion recent;
  for (int i = 0; i < count; ++i) remember(recent, forward(i, i + 1, 0.1), false);
  return recent;
}

TEST(MotionPlausibility, NothingIsImplausibleAtFirst) {
  EXPECT_FALSE(is_implausible(after_motions(2), forward(2, 3, 5)));
  EXPECT_TRUE(is_implausible(after_motions(3), forward(3, 4, 5)));
}

// 0.1 m a second before: 0.2 m more than that and another 0.1 m.
TEST(MotionPlausibility, AllowsMoreThanTheRecentLength) {
  const RecentMotion recent = after_motions(4);
  EXPECT_FALSE(is_implausible(recent, forward(4, 5, 0.39)));
  EXPECT_TRUE(is_implausible(recent, forward(4, 5, 0.41)));
  EXPECT_FALSE(is_implausible(recent, forward(4, 5, -0.29)));
  EXPECT_TRUE(is_implausible(recent, forward(4, 5, -0.31)));
}

TEST(MotionPlausibility, ARoverGoesOnInAGap) {
  const RecentMotion recent = after_motions(4);
  EXPECT_FALSE(is_implausible(recent, forward(4, 14, 1.2)));
  EXPECT_FALSE(is_implausible(recent, forward(13, 14, 1.2))) << "the same frame was shown since 4 s";
  EXPECT_FALSE(is_implausible(recent, forward(4, 14, 0)));
}

TEST(MotionPlausibility, AnUncertainMotionCountsAsFarAsItIsPlausible) {
  RecentMotion recent = after_motions(4);
  remember(recent, forward(4, 5, 5), true);
  EXPECT_NEAR(recent.length_m, 0.3, 1e-12);
  EXPECT_NEAR(recent.velocity_m_s.x(), 0.3, 1e-12);
  const RecentMotion before = recent;
  remember(recent, forward(5, 6, 0), false);
  EXPECT_EQ(recent.end, before.end) << "a stationary rover";
}

}  // namespace
}  // namespace spartan::internal
