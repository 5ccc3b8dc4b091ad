#include "spartan/system/internal/wheel_slip.h"

#include <gtest/gtest.h>

namespace spartan::internal {
namespace {

std::vector<FrameRecord> frames_with(const std::vector<std::optional<double>>& slips) {
  std::vector<FrameRecord> frames;
  for (const auto& slip : slips) {
    FrameRecord frame;
    frame.stamp = {static_cast<std::int64_t>(frames.size()) * 1000};
    frame.localization.emplace();
    frame.localization->slip = slip;
    if (slip) frame.localization->slip_sigma = 0.1;
    frames.push_back(frame);
  }
  return frames;
}

TEST(WheelSlip, JoinsConsecutiveFramesBeyondTheLimit) {
  const auto slip =
      wheel_slip_of(frames_with({0.05, 0.55, 0.7, std::nullopt, 0.9, 0.02, 0.65, 0.61, std::nullopt}), 0.4);
  ASSERT_TRUE(slip);
  EXPECT_EQ(slip->largest, 0.9);
  EXPECT_EQ(slip->median, 0.61);
  ASSERT_EQ(slip->alarms.size(), 2U);
  EXPECT_EQ(slip->alarms[0].from.ns, 2000) << "0.55 is within two standard deviations of the limit";
  EXPECT_EQ(slip->alarms[0].to.ns, 4000);
  EXPECT_EQ(slip->alarms[0].largest, 0.9);
  EXPECT_EQ(slip->alarms[1].from.ns, 6000);
  EXPECT_EQ(slip->alarms[1].to.ns, 7000);
}

TEST(WheelSlip, NothingWithoutWheels) {
  EXPECT_FALSE(wheel_slip_of(frames_with({std::nullopt, std::nullopt}), 0.4));
  FrameRecord without;
  EXPECT_FALSE(wheel_slip_of({without}, 0.4));
}

}  // namespace
}  // namespace spartan::internal
