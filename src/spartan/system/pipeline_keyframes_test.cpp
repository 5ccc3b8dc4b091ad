// Pipeline: maps of the keyframes of a rover with one stereo pair.
#include <gtest/gtest.h>

#include <optional>
#include <utility>
#include <vector>

#include "spartan/storage/database.h"
#include "spartan/system/internal/mapping_rover_test.h"
#include "spartan/system/pipeline.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using testing::frame_of;
using testing::images_of;
using testing::mapping_rover;
using testing::pose_at;

constexpr int kDriven = 6;  // frames

Rig narrow_rover() {
  Rig rig = mapping_rover();
  std::erase_if(rig.cameras, [](const Camera& camera) { return camera.name.starts_with("wide"); });
  std::erase_if(rig.pairs, [](const StereoPair& pair) { return pair.name == "wide"; });
  return rig;
}

RunOptions keyframe_options() {
  RunOptions options;
  options.mapping.map.extent_m = 4;
  options.keyframes.every_m = 0.4;
  options.keyframes.new_ground = 1;
  options.keyframes.turn_deg = 180;
  options.keyframes.delay_frames = 2;
  return options;
}

Pipeline narrow_pipeline(int threads) {
  return Pipeline::create(narrow_rover(), keyframe_options(), ThreadPool(threads)).value();
}

StereoFrame narrow_frame(int index) {
  StereoFrame frame = frame_of(images_of("narrow", index), "narrow", index, 0.5 * index);
  frame.position_id = -1;
  return frame;
}

struct Drive {
  std::vector<FrameResult> frames;
  std::optional<MappedStop> last;
};

Drive drive(Pipeline& pipeline, int from = 0) {
  Drive result;
  for (int i = from; i < kDriven; ++i) result.frames.push_back(pipeline.add(narrow_frame(i)).value().value());
  result.last = pipeline.finish_stop().value();
  return result;
}

void expect_same_stop(const MappedStop& a, const MappedStop& b) {
  EXPECT_EQ(a.stamp, b.stamp);
  EXPECT_EQ(a.merged.match.status, b.merged.match.status);
  EXPECT_EQ(a.merged.corrected.pose.matrix(), b.merged.corrected.pose.matrix());
  EXPECT_EQ(a.merged.corrected.covariance, b.merged.corrected.covariance);
  ASSERT_EQ(a.merged.local.size(), b.merged.local.size());
  for (int y = 0; y < a.merged.local.size().height; ++y) {
    for (int x = 0; x < a.merged.local.size().width; ++x)
      ASSERT_EQ(a.merged.local.count(x, y), b.merged.local.count(x, y));
  }
}

TEST(PipelineKeyframes, AreMappedSomeFramesLater) {
  Pipeline pipeline = narrow_pipeline(2);
  const Drive driven = drive(pipeline);
  std::vector<int> mapped;
  for (int i = 0; i < kDriven; ++i) {
    if (driven.frames[static_cast<std::size_t>(i)].stop) mapped.push_back(i);
  }
  EXPECT_EQ(mapped, (std::vector{3})) << "frame 0 after two frames; frame 3, 45 cm later, is the next keyframe";
  const MappedStop& first = *driven.frames[3].stop;
  EXPECT_EQ(first.stamp, Stamp());
  EXPECT_EQ(first.views, 1);
  EXPECT_LT(first.position_id, 0);
  EXPECT_EQ(first.merged.match.status, MatchStatus::no_overlap) << "the first map";
  ASSERT_TRUE(driven.last);
  EXPECT_EQ(driven.last->stamp, Stamp::from_seconds(1.5));
  EXPECT_NE(driven.last->merged.match.status, MatchStatus::no_overlap);
  EXPECT_LT((driven.last->merged.corrected.pose.translation() - pose_at(3).translation()).norm(), 0.02);
  EXPECT_EQ(pipeline.global_map().stops().size(), 2U);
  EXPECT_FALSE(pipeline.finish_stop().value()) << "no keyframe is pending";
}

TEST(PipelineKeyframes, NumberOfThreadsDoesNotChangeTheMaps) {
  Pipeline one = narrow_pipeline(1), two = narrow_pipeline(2);
  const Drive a = drive(one), b = drive(two);
  ASSERT_TRUE(a.frames[3].stop && b.frames[3].stop && a.last && b.last);
  expect_same_stop(*a.frames[3].stop, *b.frames[3].stop);
  expect_same_stop(*a.last, *b.last);
  EXPECT_EQ(one.save(), two.save());
}

TEST(PipelineKeyframes, PendingKeyframeContinuesFromRestoredState) {
  for (int saved_after = 0; saved_after < kDriven - 1; ++saved_after) {
    SCOPED_TRACE(saved_after);
    const testing::TemporaryFolder folder;
    Database db = Database::open(folder.path() + "/maps.sqlite", Database::Mode::create).value();
    TileStore tiles = TileStore::open(db).value();
    Pipeline pipeline = narrow_pipeline(2);
    pipeline.store_maps_in(tiles);
    for (int i = 0; i <= saved_after; ++i) ASSERT_TRUE(pipeline.add(narrow_frame(i)));
    ASSERT_TRUE(db.execute("BEGIN IMMEDIATE") && pipeline.flush_maps() && db.execute("COMMIT"));
    const Bytes state = pipeline.save();
    const Drive whole = drive(pipeline, saved_after + 1);

    Pipeline resumed = narrow_pipeline(1);
    resumed.store_maps_in(tiles);
    ASSERT_TRUE(resumed.restore(state, tiles));
    for (const FrameKey& key : resumed.pending_frames()) {
      const int index = static_cast<int>(2 * key.left_stamp.seconds());
      ASSERT_TRUE(resumed.restore_frame(narrow_frame(index)));
    }
    EXPECT_TRUE(resumed.pending_frames().empty());
    EXPECT_EQ(resumed.save(), state);
    const Drive rest = drive(resumed, saved_after + 1);
    EXPECT_EQ(pipeline.save(), resumed.save());
    ASSERT_EQ(whole.last.has_value(), rest.last.has_value());
    if (whole.last) expect_same_stop(*whole.last, *rest.last);
    for (std::size_t i = 0; i < rest.frames.size(); ++i) {
      ASSERT_EQ(whole.frames[i].stop.has_value(), rest.frames[i].stop.has_value());
      if (rest.frames[i].stop) expect_same_stop(*whole.frames[i].stop, *rest.frames[i].stop);
    }
  }
}

TEST(PipelineKeyframes, LiveFramesDoNotWaitWithoutADelay) {
  RunOptions options = keyframe_options();
  options.keyframes.delay_frames = 0;
  Pipeline live = Pipeline::create(narrow_rover(), options, ThreadPool(1), {}, Pace::live).value();
  ASSERT_TRUE(live.add(narrow_frame(0)));
  EXPECT_FALSE(live.add(narrow_frame(1)).value()->stop) << "its map is begun at this frame";
  const auto last = live.finish_stop().value();
  ASSERT_TRUE(last);
  EXPECT_EQ(last->stamp, Stamp());
}

TEST(PipelineKeyframes, MayBeAbandonedAtAnyFrame) {
  for (int frames = 1; frames < kDriven; ++frames) {
    Pipeline pipeline = narrow_pipeline(2);
    for (int i = 0; i < frames; ++i) ASSERT_TRUE(pipeline.add(narrow_frame(i)));
    Pipeline moved = std::move(pipeline);
    EXPECT_TRUE(moved.add(narrow_frame(frames)));
  }  // a map may be in the making
}

}  // namespace
}  // namespace spartan
