#include "spartan/system/internal/stationary_check.h"

#include <gtest/gtest.h>

#include <random>

namespace spartan::internal {
namespace {

Stamp at(double seconds) {
  return Stamp::from_seconds(100 + seconds);
}
RoverMotion frame_at(double seconds, double speed_m_s, double rate_rad_s = 0) {
  RoverMotion motion{at(seconds), 0, Vector6d::Zero()};
  motion.velocity(0) = speed_m_s;
  motion.velocity(5) = rate_rad_s;
  return motion;
}

TEST(StationaryCheck, NeedsHalfASecondWithoutMotion) {
  StationaryCheck check;
  for (int i = 0; i < 5; ++i) check.add(frame_at(0.1 * i, 0.1));
  EXPECT_FALSE(check.is_stationary());
  EXPECT_TRUE(check.drives());
  for (int i = 5; i < 9; ++i) check.add(frame_at(0.1 * i, 0.001));
  EXPECT_FALSE(check.is_stationary()) << "0.4 s";
  EXPECT_FALSE(check.drives());
  check.add(frame_at(0.95, 0.001));
  EXPECT_TRUE(check.is_stationary());
  check.add(frame_at(1.05, 0.001, 0.1));
  EXPECT_FALSE(check.is_stationary()) << "it turns";
}

TEST(StationaryCheck, TheGyroscopeAloneDoesNotShowASpeed) {
  StationaryCheck check;
  for (int i = 0; i < 200; ++i) check.add(ImuSample{at(0.01 * i), {0.001, 0, 0}, {0, 0, 9.8}});
  EXPECT_FALSE(check.is_stationary());
  for (int i = 0; i < 20; ++i) check.add(WheelSample{at(2 + 0.1 * i), 5, 5});
  EXPECT_TRUE(check.is_stationary());
  check.add(ImuSample{at(4), {0, 0, 0.5}, {0, 0, 9.8}});
  EXPECT_FALSE(check.is_stationary());
  EXPECT_TRUE(check.drives());
}

// As in EuRoC's recordings: a bias of 0.08 rad/s, and noise.
TEST(StationaryCheck, ABiasOfTheGyroscopeIsNoMotion) {
  StationaryCheck check;
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 0.007);
  const auto sample_at = [&](double seconds, double rate_rad_s) {
    return ImuSample{
        at(seconds), {0.002 + noise(random), 0.021 + noise(random), rate_rad_s + noise(random)}, {0, 0, 9.8}};
  };
  for (int i = 0; i < 200; ++i) {
    check.add(sample_at(0.005 * i, 0.078));
    EXPECT_FALSE(check.drives()) << i;
    if (i % 20 == 0) check.add(frame_at(0.005 * i, 0.001));
  }
  EXPECT_TRUE(check.is_stationary());
  for (int i = 200; i < 220; ++i) check.add(sample_at(0.005 * i, 0.078 + 0.1));
  EXPECT_EQ(check.state(), StationaryCheck::State::shaken) << "it begins to turn";
  check.add(sample_at(1.1, 0.5));
  EXPECT_TRUE(check.drives());
}

// An encoder with steps of 1 mm, read every 20 ms.
TEST(StationaryCheck, StepsOfAnEncoderAreNoMotion) {
  StationaryCheck check;
  for (int i = 0; i < 100; ++i) check.add(WheelSample{at(0.02 * i), i % 2 == 0 ? 1.0 : 1.001, 1});
  EXPECT_TRUE(check.is_stationary());
  for (int i = 100; i < 150; ++i) check.add(WheelSample{at(0.02 * i), 1 + 0.0004 * (i - 100), 1});
  EXPECT_FALSE(check.is_stationary()) << "20 mm/s";
}

TEST(StationaryCheck, AMeanOverALongIntervalIsNoDriving) {
  StationaryCheck check;
  check.add(frame_at(0, 0));
  for (int i = 0; i < 20; ++i) check.add(WheelSample{at(0.1 * i), 1, 1});
  check.add(frame_at(2, 0.05));
  EXPECT_FALSE(check.drives());
  check.add(frame_at(2.1, 0.05));
  EXPECT_TRUE(check.drives());
}

}  // namespace
}  // namespace spartan::internal
