// Pipeline: maps and terrain views that the back end makes beside the frames.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "spartan/storage/database.h"
#include "spartan/system/internal/mapping_rover_test.h"
#include "spartan/system/pipeline.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using testing::frame_of;
using ::testing::HasSubstr;
using testing::images_of;
using testing::mapping_rover;
using testing::pose_at;

constexpr int kImages = 5;  // of the rendered drive; the rover then waits at the last place
constexpr int kDelay = 3;

RunOptions with_delay() {
  RunOptions options;
  options.stop_delay_frames = kDelay;
  options.terrain.delay_frames = 2;
  return options;
}

// The images of an index; a stationary rover sees the same ground, but its sensor another noise.
StereoFrame view_at(const std::string& pair, int index, int position_id, double seconds) {
  return frame_of(images_of(pair, std::min(index, kImages - 1)), pair, position_id, seconds);
}

// Frame i of the narrow pair is at position i.
Result<std::optional<FrameResult>> drive_narrow_to(Pipeline& pipeline, int index) {
  return pipeline.add(view_at("narrow", index, index, 3.0 * index));
}
void add_wide_view_at(Pipeline& pipeline, int index) {
  ASSERT_FALSE(pipeline.add(view_at("wide", index, index, 3.0 * index + 1)).value().has_value());
}

struct Applied {
  int frame = -1;  // with which it was delivered
  std::int64_t position_id = -1;
};

// Drives with views at positions 0 and 1.
std::vector<Applied> drive_all(Pipeline& pipeline, int first = 0, int frames = kImages) {
  std::vector<Applied> applied;
  for (int i = first; i < frames; ++i) {
    const FrameResult result = drive_narrow_to(pipeline, i).value().value();
    if (result.stop) applied.push_back({i, result.stop->position_id});
    if (i < 2) add_wide_view_at(pipeline, i);
  }
  return applied;
}

TEST(PipelineBackEnd, MapsEnterAtStatedFrames) {
  for (const int threads : {1, 2}) {
    Pipeline pipeline = Pipeline::create(mapping_rover(), with_delay(), ThreadPool(threads)).value();
    const auto applied = drive_all(pipeline);
    ASSERT_EQ(applied.size(), 1U);
    EXPECT_EQ(applied[0].frame, 2) << "the next stop departs, so it cannot wait any longer";
    EXPECT_EQ(applied[0].position_id, 0);
    const auto last = pipeline.finish_stop().value();
    ASSERT_TRUE(last) << "three frames after the departure there would have been another one";
    EXPECT_EQ(last->position_id, 1);
    EXPECT_EQ(last->merged.match.status, MatchStatus::decided);
    EXPECT_FALSE(pipeline.finish_stop().value());
  }
}

TEST(PipelineBackEnd, ResultsDoNotDependOnThreads) {
  Pipeline one = Pipeline::create(mapping_rover(), with_delay(), ThreadPool(1)).value(),
           two = Pipeline::create(mapping_rover(), with_delay(), ThreadPool(2)).value();
  for (int i = 0; i < kImages; ++i) {
    const FrameResult a = drive_narrow_to(one, i).value().value(), b = drive_narrow_to(two, i).value().value();
    EXPECT_EQ(a.localization->world_from_body.pose.matrix(), b.localization->world_from_body.pose.matrix());
    EXPECT_EQ(a.stop.has_value(), b.stop.has_value());
    EXPECT_EQ(a.terrain.has_value(), b.terrain.has_value());
    EXPECT_EQ(one.save(), two.save());
    if (i >= 2) continue;
    add_wide_view_at(one, i);
    add_wide_view_at(two, i);
  }
}

TEST(PipelineBackEnd, TerrainComesSomeFramesLaterAtThePoseOfItsFrame) {
  Pipeline pipeline = Pipeline::create(mapping_rover(), with_delay(), ThreadPool(1)).value();
  EXPECT_FALSE(drive_narrow_to(pipeline, 0).value()->terrain);
  EXPECT_FALSE(drive_narrow_to(pipeline, 1).value()->terrain);
  const auto third = drive_narrow_to(pipeline, 2).value();
  ASSERT_TRUE(third->terrain);
  EXPECT_EQ(third->terrain->stamp, Stamp::from_seconds(0));
  EXPECT_EQ(third->terrain->disparity.size(), third->terrain->left.size());
  const Pose expected = pose_at(0) * mapping_rover().body_from_camera("narrow_left");
  EXPECT_LT((third->terrain->world_from_left.translation() - expected.translation()).norm(), 1e-3);
  EXPECT_FALSE(pipeline.finish_terrain()) << "it was delivered";
}

// Saved while the map of a stop and a terrain view are made, and views of the next stop are computed.
TEST(PipelineBackEnd, ContinuesFromRestoredState) {
  Pipeline uninterrupted = Pipeline::create(mapping_rover(), with_delay(), ThreadPool(1)).value();
  drive_narrow_to(uninterrupted, 0).value();
  add_wide_view_at(uninterrupted, 0);
  drive_narrow_to(uninterrupted, 1).value();
  add_wide_view_at(uninterrupted, 1);
  const testing::TemporaryFolder folder;
  Database db = Database::open(folder.path() + "/maps.sqlite", Database::Mode::create).value();
  TileStore tiles = TileStore::open(db).value();
  Pipeline resumed = Pipeline::create(mapping_rover(), with_delay(), ThreadPool(2)).value();
  ASSERT_TRUE(resumed.restore(uninterrupted.save(), tiles));
  const auto pending = resumed.pending_frames();
  ASSERT_EQ(pending.size(), 5U) << "the terrain view, and two views of each stop";
  for (const FrameKey& key : pending) {
    const int index = key.left_stamp.seconds() < 3 ? 0 : 1;
    ASSERT_TRUE(resumed.restore_frame(view_at(key.pair, index, index, key.left_stamp.seconds())));
  }
  EXPECT_TRUE(resumed.pending_frames().empty());
  EXPECT_EQ(uninterrupted.save(), resumed.save());
  for (int i = 2; i < kImages; ++i) {
    const auto one = drive_narrow_to(uninterrupted, i).value(), other = drive_narrow_to(resumed, i).value();
    EXPECT_EQ(one->localization->world_from_body.pose.matrix(), other->localization->world_from_body.pose.matrix());
    EXPECT_EQ(one->stop.has_value(), other->stop.has_value());
    EXPECT_EQ(one->terrain.has_value(), other->terrain.has_value());
    EXPECT_EQ(uninterrupted.save(), resumed.save()) << i;
  }
  const auto one = uninterrupted.finish_stop().value(), other = resumed.finish_stop().value();
  ASSERT_TRUE(one && other);
  EXPECT_EQ(one->merged.corrected.pose.matrix(), other->merged.corrected.pose.matrix());
}

// Frames of a dense odometry use the computer that makes the disparities of the pending terrain view, and follow at
// once.
TEST(PipelineBackEnd, DenseOdometryContinuesFromRestoredState) {
  RunOptions options = with_delay();
  options.maps = false;
  options.odometry.reconstruction.source = DisparitySource::dense;
  std::vector<StereoFrame> frames;
  frames.reserve(kImages);
  for (int i = 0; i < kImages; ++i) frames.push_back(view_at("narrow", i, i, 3.0 * i));
  Pipeline uninterrupted = Pipeline::create(mapping_rover(), options, ThreadPool(1)).value();
  std::vector<Bytes> states;
  std::vector<Image<float>> terrain;
  for (const StereoFrame& frame : frames) {
    auto result = uninterrupted.add(frame).value();
    if (result->terrain) terrain.push_back(std::move(result->terrain->disparity));
    states.push_back(uninterrupted.save());
  }
  ASSERT_FALSE(terrain.empty());
  const testing::TemporaryFolder folder;
  Database db = Database::open(folder.path() + "/maps.sqlite", Database::Mode::create).value();
  TileStore tiles = TileStore::open(db).value();
  for (const Pace pace : {Pace::recorded, Pace::live}) {
    Pipeline resumed = Pipeline::create(mapping_rover(), options, ThreadPool(2), {}, pace).value();
    ASSERT_TRUE(resumed.restore(states[0], tiles));
    ASSERT_EQ(resumed.pending_frames().size(), 1U) << "the terrain view";
    ASSERT_TRUE(resumed.restore_frame(frames[0]));
    std::size_t views = 0;
    for (std::size_t i = 1; i < frames.size(); ++i) {
      const auto result = resumed.add(frames[i]).value();
      EXPECT_EQ(resumed.save(), states[i]) << i;
      if (!result->terrain) continue;
      ASSERT_LT(views, terrain.size());
      const Image<float>&expected = terrain[views++], &found = result->terrain->disparity;
      ASSERT_EQ(found.size(), expected.size());
      for (int y = 0; y < found.height(); ++y) {
        const auto bytes = sizeof(float) * static_cast<std::size_t>(found.width());
        ASSERT_EQ(std::memcmp(&found(0, y), &expected(0, y), bytes), 0) << y;
      }
    }
    EXPECT_EQ(views, terrain.size());
  }
}

TEST(PipelineBackEnd, LiveFramesDoNotWait) {
  Pipeline pipeline = Pipeline::create(mapping_rover(), with_delay(), ThreadPool(1), {}, Pace::live).value();
  drive_narrow_to(pipeline, 0).value();
  add_wide_view_at(pipeline, 0);
  std::optional<MappedStop> stop;
  // The rover has left, and stays in front of the stop until its map is there.
  for (int i = 1; i < 2000 && !stop; ++i) {
    const StereoFrame frame = view_at("narrow", 1, -1, 3 + 0.1 * i);
    auto result = pipeline.add(frame);
    ASSERT_TRUE(result) << result.error().message();
    if ((*result)->stop) stop = std::move((*result)->stop);
    if (i > kDelay) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  ASSERT_TRUE(stop);
  EXPECT_EQ(stop->position_id, 0);
  EXPECT_EQ(stop->views, 2);
}

TEST(PipelineBackEnd, LiveViewsAreDroppedWhereTooManyWait) {
  Pipeline pipeline = Pipeline::create(mapping_rover(), with_delay(), ThreadPool(1), {}, Pace::live).value();
  drive_narrow_to(pipeline, 0).value();
  int dropped = 0;
  for (int i = 0; i < 60; ++i) {
    const StereoFrame view = view_at("wide", 0, 0, 1 + 0.1 * i);
    const auto result = pipeline.add(view);
    if (result) continue;
    ++dropped;
    EXPECT_EQ(result.error().code, ErrorCode::frame_rejected);
    EXPECT_THAT(result.error().what, HasSubstr("dropped"));
    EXPECT_EQ(pipeline.fault_of(view), FrameFault::dropped);
  }
  EXPECT_GT(dropped, 0);
  EXPECT_TRUE(drive_narrow_to(pipeline, 1)) << "frames of the odometry are never dropped";
}

// The points of a stop take tens of MB until its map is applied.
TEST(PipelineBackEnd, LiveViewsAreDroppedWhereTooManyStopsWait) {
  RunOptions options = with_delay();
  options.stop_delay_frames = 1000;
  Pipeline pipeline = Pipeline::create(mapping_rover(), options, ThreadPool(1), {}, Pace::live).value();
  int views = 0;
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(pipeline.add(view_at("narrow", 0, i, 2.0 * i))) << "frames of the odometry are never dropped";
    const StereoFrame view = view_at("wide", 0, i, 2.0 * i + 1);
    const auto result = pipeline.add(view);
    views += result.has_value();
    if (!result) {
      EXPECT_EQ(pipeline.fault_of(view), FrameFault::dropped);
    }
  }
  EXPECT_EQ(views, 4);
}

}  // namespace
}  // namespace spartan
