#include "spartan/system/internal/stop_stage.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace spartan::internal {
namespace {

const RectifiedStereo kStereo{{64, 48}, 60, {31.5, 23.5}, 0.1};
constexpr double kNearest_m = 0.4;
constexpr int kDelayFrames = 3;

// Black images: their content does not matter here.
struct TestImages {
  Image<std::uint8_t> left{64, 48}, right{64, 48};
  RectifiedPair pair(double seconds) const {
    RectifiedPair made;
    made.pair = "wide";
    made.stamp = Stamp::from_seconds(seconds);
    made.geometry = kStereo;
    made.left = left;
    made.right = right;
    made.body_from_left = Pose::from_translation({0, 0, 1}) * optical_from_forward().inverse();
    return made;
  }
};

Bytes saved(const StopStage& stage) {
  ArchiveWriter out;
  stage.save(out);
  return out.take();
}

// Neither the view nor the first frame of the stop is retained; the first frame becomes a view only with another one.
TEST(StopStage, RejectedViewLeavesStateUnchanged) {
  BackEnd back_end(ThreadPool(1), false);
  StopStage stage(StopMapper::create({}, {}, ThreadPool(1)).value(), kDelayFrames);
  const TestImages images;
  TestImages wrong_size;
  wrong_size.right = Image<std::uint8_t>(60, 48);
  ASSERT_TRUE(stage.add_odometry_frame(1, images.pair(0), kNearest_m, {}, {}, back_end));
  const Bytes before = saved(stage);
  const Status refused = stage.add_view(1, "wide", wrong_size.pair(1), kNearest_m, back_end);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::frame_rejected);
  EXPECT_EQ(saved(stage), before);
  stage.depart(back_end);
  EXPECT_FALSE(stage.has_departed()) << "no view was added";
}

// The check is done when the view is added, not when the odometry pair reaches the stop.
TEST(StopStage, EarlyViewIsRejectedWhenAdded) {
  BackEnd back_end(ThreadPool(1), false);
  StopStage stage(StopMapper::create({}, {}, ThreadPool(1)).value(), kDelayFrames);
  const TestImages images;
  TestImages wrong_size;
  wrong_size.left = Image<std::uint8_t>(64, 40);
  ASSERT_TRUE(stage.add_view(1, "wide", images.pair(0), kNearest_m, back_end));
  const Bytes before = saved(stage);
  EXPECT_FALSE(stage.add_view(1, "wide", wrong_size.pair(1), kNearest_m, back_end));
  EXPECT_FALSE(stage.add_view(2, "wide", wrong_size.pair(2), kNearest_m, back_end));
  EXPECT_EQ(saved(stage), before) << "the view of the next stop is retained";
  ASSERT_TRUE(stage.add_odometry_frame(1, images.pair(3), kNearest_m, {}, {}, back_end));
  stage.depart(back_end);
  ASSERT_TRUE(stage.has_departed());
  EXPECT_EQ(stage.survey().views, 2);
}

// The odometry pair's first frame is also a view of the stop.
TEST(StopStage, RejectedFirstFrameLeavesStateUnchanged) {
  BackEnd back_end(ThreadPool(1), false);
  StopStage stage(StopMapper::create({}, {}, ThreadPool(1)).value(), kDelayFrames);
  const TestImages images;
  TestImages wrong_size;
  wrong_size.right = Image<std::uint8_t>(64, 40);
  ASSERT_TRUE(stage.add_view(1, "wide", images.pair(0), kNearest_m, back_end));
  const Bytes before = saved(stage);
  EXPECT_FALSE(stage.add_odometry_frame(1, wrong_size.pair(1), kNearest_m, {}, {}, back_end));
  EXPECT_EQ(saved(stage), before);
  EXPECT_EQ(stage.position_id(), -1);
}

// The map of a stop is due so many frames after the rover left it; the pose of the latest frame comes with it.
TEST(StopStage, MapIsDueSomeFramesAfterTheDeparture) {
  BackEnd back_end(ThreadPool(1), false);
  StopStage stage(StopMapper::create({}, {}, ThreadPool(1)).value(), kDelayFrames);
  const auto merger = MapMerger::create({}, {}, ThreadPool(1)).value();
  const TestImages images;
  RelativeMotion step;
  step.previous_from_current = Pose::from_translation({0.1, 0, 0});
  const auto drive = [&](double seconds, std::int64_t position_id) {
    step.from = step.to;
    step.to = Stamp::from_seconds(seconds);
    ASSERT_TRUE(stage.add_odometry_frame(position_id, images.pair(seconds), kNearest_m, {}, step, back_end));
  };
  drive(1, 7);
  ASSERT_TRUE(stage.add_view(7, "wide", images.pair(1.5), kNearest_m, back_end));
  drive(2, 7);
  EXPECT_FALSE(stage.has_departed());
  EXPECT_EQ(stage.position_id(), 7);
  stage.depart(back_end);
  EXPECT_EQ(stage.position_id(), -1);
  ASSERT_TRUE(stage.is_unmatched());
  EXPECT_FALSE(stage.is_due(true)) << "its match was not started";
  stage.start_match(merger, std::nullopt, StageClock(), back_end);
  EXPECT_FALSE(stage.is_unmatched());
  EXPECT_TRUE(stage.is_due(true));
  for (int frame = 1; frame <= kDelayFrames; ++frame) {
    EXPECT_FALSE(stage.is_due(false)) << frame;
    drive(2 + frame, -1);
  }
  ASSERT_TRUE(stage.is_due(false));
  back_end.wait(stage.ticket());
  const StopSurvey survey = stage.survey();
  EXPECT_EQ(survey.position_id, 7);
  EXPECT_EQ(survey.stamp, Stamp::from_seconds(1));
  EXPECT_EQ(survey.last_stamp, Stamp::from_seconds(2 + kDelayFrames));
  EXPECT_NEAR(survey.first_from_last.pose.translation().x(), 0.1 * (1 + kDelayFrames), 1e-12);
  const StopStage::Mapped mapped = stage.take_oldest();
  EXPECT_FALSE(stage.has_departed());
  EXPECT_EQ(mapped.matched.match.status, MatchStatus::no_overlap) << "the global map is empty";
  EXPECT_FALSE(mapped.times.empty());
}

// While the map of a stop is made, the next stop begins and departs; maps are applied in their order.
TEST(StopStage, StopsWaitForTheOneBefore) {
  BackEnd back_end(ThreadPool(1), false);
  StopStage stage(StopMapper::create({}, {}, ThreadPool(1)).value(), kDelayFrames);
  const auto merger = MapMerger::create({}, {}, ThreadPool(1)).value();
  const TestImages images;
  for (const std::int64_t position : {1, 2, 3}) {
    const auto seconds = static_cast<double>(position);
    ASSERT_TRUE(stage.add_odometry_frame(position, images.pair(seconds), kNearest_m, {}, {}, back_end));
    ASSERT_TRUE(stage.add_view(position, "wide", images.pair(seconds + 0.5), kNearest_m, back_end));
    stage.depart(back_end);
  }
  for (const std::int64_t position : {1, 2, 3}) {
    ASSERT_TRUE(stage.is_unmatched()) << position;
    stage.start_match(merger, std::nullopt, StageClock(), back_end);
    back_end.wait(stage.ticket());
    EXPECT_EQ(stage.survey().position_id, position);
    stage.take_oldest();
  }
  EXPECT_FALSE(stage.has_departed());
}

// The images are passed in again in the order of pending_frames().
TEST(StopStage, SavedStopsAreRestoredWithTheirImages) {
  BackEnd back_end(ThreadPool(1), false);
  StopStage stage(StopMapper::create({}, {}, ThreadPool(1)).value(), kDelayFrames);
  const TestImages images;
  ASSERT_TRUE(stage.add_odometry_frame(1, images.pair(1), kNearest_m, {}, {}, back_end));
  ASSERT_TRUE(stage.add_view(1, "wide", images.pair(1.5), kNearest_m, back_end));
  stage.depart(back_end);
  ASSERT_TRUE(stage.add_odometry_frame(2, images.pair(2), kNearest_m, {}, {}, back_end));
  ASSERT_TRUE(stage.add_view(2, "wide", images.pair(2.5), kNearest_m, back_end));
  ASSERT_TRUE(stage.add_view(3, "wide", images.pair(3.5), kNearest_m, back_end));
  const Bytes before = saved(stage);

  BackEnd other_back_end(ThreadPool(1), false);
  StopStage other(StopMapper::create({}, {}, ThreadPool(1)).value(), kDelayFrames);
  ArchiveReader in(before);
  other.restore(in);
  ASSERT_TRUE(in.finish("state"));
  const std::vector<FrameKey> pending = other.pending_frames("narrow");
  std::vector<std::pair<std::string, double>> keys;
  keys.reserve(pending.size());
  for (const FrameKey& key : pending) keys.emplace_back(key.pair, key.left_stamp.seconds());
  const std::vector<std::pair<std::string, double>> expected{
      {"narrow", 1}, {"wide", 1.5}, {"narrow", 2}, {"wide", 2.5}, {"wide", 3.5}};
  EXPECT_EQ(keys, expected);
  for (const auto& [pair, seconds] : keys) {
    if (pair == "narrow") {
      other.restore_first_frame(images.pair(seconds), kNearest_m);
    } else {
      const auto position = static_cast<std::int64_t>(seconds);
      ASSERT_TRUE(other.restore_view(pair, images.pair(seconds), kNearest_m, position, other_back_end));
    }
  }
  EXPECT_EQ(saved(other), before);
  EXPECT_TRUE(other.pending_frames("narrow").empty());
  EXPECT_TRUE(other.is_unmatched());
  EXPECT_EQ(other.position_id(), 2);
}

}  // namespace
}  // namespace spartan::internal
