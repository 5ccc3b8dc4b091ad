#include "spartan/system/sensor_spells.h"

#include <gtest/gtest.h>

namespace spartan {
namespace {

// A frame for which the compass is in this state; an empty state: a shot that is missing.
FrameRecord frame(int i, const std::string& state, const std::string& reason = "") {
  FrameRecord record;
  record.frame_id = 2 * i;
  record.stamp.ns = 100 * i;
  if (state.empty()) return record;
  record.localization.emplace().sensors = {{"imu", "ok", ""}, {"compass", state, reason}};
  return record;
}

TEST(SensorSpells, JoinFramesWithTheSameStateAndKindOfReason) {
  const std::vector<FrameRecord> frames{frame(0, "missing", "has not said anything"),
                                        frame(1, "missing", "has not said anything"),
                                        frame(2, "ok"),
                                        frame(3, "suspect", "disagrees with the other sensors: 14.3, at most 10.8"),
                                        frame(4, ""),
                                        frame(5, "suspect", "disagrees with the other sensors: inf, at most 10.8"),
                                        frame(6, "excluded", "disagrees with the other sensors: 25.0, at most 10.8"),
                                        frame(7, "missing", "silent for 1.2 s"),
                                        frame(8, "missing", "silent for 2.2 s"),
                                        frame(9, "excluded", "gives the same reading again and again"),
                                        frame(10, "excluded", "gives readings that no rover can have"),
                                        frame(11, "ok"),
                                        frame(12, "excluded", "gives readings that no rover can have")};
  const auto spells = sensor_spells(frames, "compass");
  ASSERT_EQ(spells.size(), 7U);
  const auto expect = [&](std::size_t i, const std::string& state, int first, int last, int count) {
    EXPECT_EQ(spells[i].state, state) << i;
    EXPECT_EQ(spells[i].from.ns, 100 * first) << i;
    EXPECT_EQ(spells[i].to.ns, 100 * last) << i;
    EXPECT_EQ(spells[i].first_frame_id, 2 * first) << i;
    EXPECT_EQ(spells[i].last_frame_id, 2 * last) << i;
    EXPECT_EQ(spells[i].frames, count) << i;
  };
  expect(0, "missing", 0, 1, 2);
  expect(1, "suspect", 3, 5, 2);
  expect(2, "excluded", 6, 6, 1);
  expect(3, "missing", 7, 8, 2);
  expect(4, "excluded", 9, 9, 1);
  expect(5, "excluded", 10, 10, 1);
  expect(6, "excluded", 12, 12, 1);
  EXPECT_EQ(spells[1].reason, frames[3].localization->sensors[1].reason);
  EXPECT_EQ(spells[3].reason, "silent for 1.2 s");
}

TEST(SensorSpells, ThereAreNoneOfASensorThatWasOkOrUnknown) {
  const std::vector<FrameRecord> frames{frame(0, "suspect", "x"), frame(1, "ok")};
  EXPECT_TRUE(sensor_spells(frames, "imu").empty());
  EXPECT_TRUE(sensor_spells(frames, "sonar").empty());
  EXPECT_EQ(sensor_spells(frames, "compass").size(), 1U);
}

}  // namespace
}  // namespace spartan
