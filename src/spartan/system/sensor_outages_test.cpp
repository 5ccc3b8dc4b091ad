#include <gtest/gtest.h>

#include "spartan/system/run_store.h"

namespace spartan {
namespace {

// A frame at which the compass is in this state; an empty state: a missing frame.
FrameRecord frame(int i, const std::string& state, const std::string& reason = "") {
  FrameRecord record;
  record.frame_id = 2 * i;
  record.stamp.ns = 100 * i;
  if (state.empty()) return record;
  record.localization.emplace().sensors = {{"imu", "ok", ""}, {"compass", state, reason}};
  return record;
}

TEST(SensorOutages, JoinConsecutiveFramesOfSameStateAndReason) {
  const std::vector<FrameRecord> frames{frame(0, "missing", "no measurement received yet"),
                                        frame(1, "missing", "no measurement received yet"),
                                        frame(2, "ok"),
                                        frame(3, "suspect", "disagrees with the other sensors: 14.3, at most 10.8"),
                                        frame(4, ""),
                                        frame(5, "suspect", "disagrees with the other sensors: inf, at most 10.8"),
                                        frame(6, "excluded", "disagrees with the other sensors: 25.0, at most 10.8"),
                                        frame(7, "missing", "no measurement for 1.2 s"),
                                        frame(8, "missing", "no measurement for 2.2 s"),
                                        frame(9, "excluded", "readings are frozen (identical values)"),
                                        frame(10, "excluded", "readings are outside of the physical range"),
                                        frame(11, "ok"),
                                        frame(12, "excluded", "readings are outside of the physical range")};
  const auto outages = sensor_outages(frames, "compass");
  ASSERT_EQ(outages.size(), 7U);
  const auto expect = [&](std::size_t i, const std::string& state, int first, int last, int count) {
    EXPECT_EQ(outages[i].state, state) << i;
    EXPECT_EQ(outages[i].from.ns, 100 * first) << i;
    EXPECT_EQ(outages[i].to.ns, 100 * last) << i;
    EXPECT_EQ(outages[i].first_frame_id, 2 * first) << i;
    EXPECT_EQ(outages[i].last_frame_id, 2 * last) << i;
    EXPECT_EQ(outages[i].frames, count) << i;
  };
  expect(0, "missing", 0, 1, 2);
  expect(1, "suspect", 3, 5, 2);
  expect(2, "excluded", 6, 6, 1);
  expect(3, "missing", 7, 8, 2);
  expect(4, "excluded", 9, 9, 1);
  expect(5, "excluded", 10, 10, 1);
  expect(6, "excluded", 12, 12, 1);
  EXPECT_EQ(outages[1].reason, frames[3].localization->sensors[1].reason);
  EXPECT_EQ(outages[3].reason, "no measurement for 1.2 s");
}

TEST(SensorOutages, NoneForSensorThatWasOkOrIsUnknown) {
  const std::vector<FrameRecord> frames{frame(0, "suspect", "x"), frame(1, "ok")};
  EXPECT_TRUE(sensor_outages(frames, "imu").empty());
  EXPECT_TRUE(sensor_outages(frames, "sonar").empty());
  EXPECT_EQ(sensor_outages(frames, "compass").size(), 1U);
}

}  // namespace
}  // namespace spartan
