// Pipeline: mapping of stops, map matching, and resuming within a stop.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "spartan/storage/database.h"
#include "spartan/system/internal/mapping_rover_test.h"
#include "spartan/system/pipeline.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

constexpr int kFrames = 5;  // of the narrow pair; the wide pair has views at the first and the last

using testing::frame_of;
using testing::images_of;
using testing::mapping_rover;
using testing::pose_at;

// Maps are applied with the frame at which the rover leaves the stop.
RunOptions without_delay() {
  RunOptions options;
  options.stop_delay_frames = 0;
  options.terrain.delay_frames = 0;
  return options;
}

FrameResult drive_to(Pipeline& pipeline, int index) {
  return pipeline.add(frame_of(images_of("narrow", index), "narrow", index, 3.0 * index)).value().value();
}
void add_wide_view(Pipeline& pipeline, int index, double after_s = 1) {
  ASSERT_FALSE(
      pipeline.add(frame_of(images_of("wide", index), "wide", index, 3.0 * index + after_s)).value().has_value());
}

TEST(PipelineMaps, StopsAreMappedAndMatchedToEachOther) {
  Pipeline pipeline = Pipeline::create(mapping_rover(), without_delay(), ThreadPool(2)).value();
  EXPECT_FALSE(drive_to(pipeline, 0).stop);
  add_wide_view(pipeline, 0);
  const FrameResult next = drive_to(pipeline, 1);
  ASSERT_TRUE(next.stop) << "the first stop is mapped at the next frame";
  EXPECT_EQ(next.stop->position_id, 0);
  EXPECT_EQ(next.stop->views, 2) << "the first narrow frame is one of its views";
  EXPECT_EQ(next.stop->merged.match.status, MatchStatus::no_overlap);
  for (int i = 2; i < kFrames; ++i) EXPECT_FALSE(drive_to(pipeline, i).stop) << "no view of the wide pair";
  add_wide_view(pipeline, kFrames - 1);
  const auto last = pipeline.finish_stop().value();
  ASSERT_TRUE(last);
  ASSERT_EQ(last->merged.match.status, MatchStatus::decided) << "after 60 cm the maps overlap";
  EXPECT_GT(last->merged.match.overlap, 0.4);
  EXPECT_LT((last->merged.corrected.pose.translation() - pose_at(kFrames - 1).translation()).norm(), 0.015);
  ASSERT_TRUE(last->merged.constraint);
  EXPECT_EQ(last->merged.constraint->stamp, Stamp::from_seconds(3.0 * (kFrames - 1)));
  EXPECT_FALSE(pipeline.finish_stop().value()) << "a stop is finished once";
}

TEST(PipelineMaps, MapConstraintUpdatesTheLocalization) {
  Pipeline pipeline = Pipeline::create(mapping_rover(), without_delay(), ThreadPool(2)).value();
  FrameResult result = drive_to(pipeline, 0);
  add_wide_view(pipeline, 0);
  for (int i = 1; i < kFrames; ++i) result = drive_to(pipeline, i);
  EXPECT_EQ(result.localization->health_of(LocalizationSensor::map).state, SensorState::missing);
  add_wide_view(pipeline, kFrames - 1);
  // The constraint of the previous stop is applied at the first frame of the next one.
  StereoFrame next = frame_of(images_of("narrow", kFrames - 1), "narrow", kFrames, 3.0 * kFrames);
  result = pipeline.add(next).value().value();
  ASSERT_TRUE(result.stop);
  EXPECT_EQ(result.localization->health_of(LocalizationSensor::map).state, SensorState::ok);
  EXPECT_EQ(result.localization->health_of(LocalizationSensor::map).used, 1);
  // It also corrects the SLAM pose, which otherwise is that of the odometry.
  const Eigen::Vector3d corrected = result.stop->merged.corrected.pose.translation();
  EXPECT_GT((corrected - result.world_from_body.pose.translation()).norm(), 1e-6);
  EXPECT_LT((result.slam->pose.translation() - corrected).norm(), 1e-8) << "the rover has not moved since";
}

TEST(PipelineMaps, MotionsHoldTheErrorsOfTheCalibration) {
  Rig uncertain = mapping_rover();
  uncertain.calibration_errors = CalibrationErrors{0, 1, 2, 3, 0};
  std::vector<FrameResult> results;
  for (const Rig& rig : {mapping_rover(), uncertain}) {
    Pipeline pipeline = Pipeline::create(rig, without_delay(), ThreadPool(2)).value();
    drive_to(pipeline, 0);
    results.push_back(drive_to(pipeline, 1));
  }
  const Pose body_from_left = uncertain.body_from_camera("narrow_left");
  const Pose motion = body_from_left * results[0].motion.previous_from_current * body_from_left.inverse();
  const Matrix6d to_body = adjoint(body_from_left);
  const Matrix6d added = to_body * (results[1].motion.covariance - results[0].motion.covariance) * to_body.transpose();
  const CalibrationEffect effect = calibration_effect(motion, body_from_left, uncertain, *uncertain.find_pair("narrow"),
                                                      *uncertain.calibration_errors);
  EXPECT_TRUE(added.isApprox(effect * effect.transpose(), 1e-6));
  EXPECT_GT(results[1].world_from_body.covariance(1, 1), 2 * results[0].world_from_body.covariance(1, 1));
}

// As in recordings whose narrow pair runs at 4 Hz through a stop of minutes, with the pans in between. The rover slides
// meanwhile and ends one step ahead.
TEST(PipelineMaps, ConstraintIsAppliedAfterLongStopWithOdometryFrames) {
  for (const double buffer_s : {0.5, 300.0}) {
    SCOPED_TRACE(buffer_s);
    RunOptions options = without_delay();
    options.localization.buffer_s = buffer_s;
    Pipeline pipeline = Pipeline::create(mapping_rover(), options, ThreadPool(2)).value();
    FrameResult result = drive_to(pipeline, 0);
    add_wide_view(pipeline, 0);
    for (int i = 1; i < kFrames; ++i) result = drive_to(pipeline, i);
    const auto add_narrow = [&](int index, int position_id, double seconds) {
      return pipeline.add(frame_of(images_of("narrow", index), "narrow", position_id, seconds)).value().value();
    };
    add_wide_view(pipeline, kFrames - 1);
    const double arrival_s = 3.0 * (kFrames - 1);
    EXPECT_FALSE(add_narrow(kFrames, kFrames - 1, arrival_s + 1.5).stop) << "it is the same stop";
    const FrameResult before = add_narrow(kFrames, kFrames - 1, arrival_s + 1.8);
    EXPECT_FALSE(before.stop);
    pipeline.add(WheelSample{Stamp::from_seconds(arrival_s + 10), 0.6, 0.6});
    result = add_narrow(kFrames, kFrames, arrival_s + 11);
    ASSERT_TRUE(result.stop);
    EXPECT_EQ(result.stop->views, 2) << "the first narrow frame and the wide one";
    EXPECT_EQ(result.stop->stamp, Stamp::from_seconds(arrival_s));
    EXPECT_EQ(result.localization->health_of(LocalizationSensor::map).used, 1);
    EXPECT_EQ(result.localization->health_of(LocalizationSensor::map).refused.too_late, 0);
    const Eigen::Vector3d truth = pose_at(kFrames).translation();
    EXPECT_LT((result.localization->world_from_body.pose.translation() - truth).norm(), 0.015);
    EXPECT_LT((result.slam->pose.translation() - truth).norm(), 0.015);
    const auto relative = [](const UncertainPose& a, const UncertainPose& b) { return a.pose.inverse() * b.pose; };
    const Pose slam = relative(*before.slam, *result.slam),
               odometry = relative(before.world_from_body, result.world_from_body);
    EXPECT_GT(log_se3(odometry.inverse() * slam).norm(), 1e-7) << "the map constraint was applied";
  }
}

TEST(PipelineMaps, ViewsMayComeBeforeTheOdometryFrame) {
  Pipeline pipeline = Pipeline::create(mapping_rover(), without_delay(), ThreadPool(2)).value();
  add_wide_view(pipeline, 0, -1);
  add_wide_view(pipeline, 0, -0.5);
  EXPECT_FALSE(drive_to(pipeline, 0).stop);
  const FrameResult next = drive_to(pipeline, 1);
  ASSERT_TRUE(next.stop);
  EXPECT_EQ(next.stop->position_id, 0);
  EXPECT_EQ(next.stop->views, 3) << "both wide views and the narrow frame";
  // A view of a stop to which the next odometry frame does not belong is discarded.
  add_wide_view(pipeline, 3, -4.5);
  drive_to(pipeline, 2);
  EXPECT_FALSE(drive_to(pipeline, 3).stop);
  EXPECT_FALSE(pipeline.finish_stop().value());
}

// Saved at a narrow frame between two wide views.
TEST(PipelineMaps, StopContinuesFromRestoredState) {
  Pipeline uninterrupted = Pipeline::create(mapping_rover(), without_delay(), ThreadPool(1)).value(),
           resumed = Pipeline::create(mapping_rover(), without_delay(), ThreadPool(2)).value();
  drive_to(uninterrupted, 0);
  add_wide_view(uninterrupted, 0);
  ASSERT_TRUE(uninterrupted.add(frame_of(images_of("narrow", 0), "narrow", 0, 1.5)).value().has_value());
  const testing::TemporaryFolder folder;
  Database db = Database::open(folder.path() + "/maps.sqlite", Database::Mode::create).value();
  TileStore tiles = TileStore::open(db).value();
  ASSERT_TRUE(resumed.restore(uninterrupted.save(), tiles));
  const auto pending = resumed.pending_frames();
  ASSERT_EQ(pending.size(), 2);
  EXPECT_EQ(pending[0].pair, "narrow");
  EXPECT_EQ(pending[0].left_stamp, Stamp::from_seconds(0)) << "only the first narrow frame is a view";
  EXPECT_EQ(pending[1].pair, "wide");
  for (const FrameKey& key : pending)
    ASSERT_TRUE(resumed.restore_frame(frame_of(images_of(key.pair, 0), key.pair, 0, key.left_stamp.seconds())));
  EXPECT_TRUE(resumed.pending_frames().empty());
  EXPECT_EQ(uninterrupted.save(), resumed.save());
  add_wide_view(uninterrupted, 0, 2);
  add_wide_view(resumed, 0, 2);
  const FrameResult one = drive_to(uninterrupted, 1), other = drive_to(resumed, 1);
  ASSERT_TRUE(one.stop && other.stop);
  EXPECT_EQ(uninterrupted.save(), resumed.save()) << "the stop is discarded";
  EXPECT_TRUE(uninterrupted.pending_frames().empty());
  EXPECT_EQ(one.stop->views, 3);
  EXPECT_EQ(other.stop->views, 3);
  const LocalMap &a = one.stop->merged.local, &b = other.stop->merged.local;
  for (int y = 0; y < a.size().height; ++y) {
    for (int x = 0; x < a.size().width; ++x) {
      ASSERT_EQ(a.count(x, y), b.count(x, y));
      if (!(a.count(x, y) > 0)) continue;
      ASSERT_EQ(a.elevation_m(x, y), b.elevation_m(x, y));
    }
  }
}

// The images of its views are lost.
TEST(PipelineMaps, AStopCanBeAbandonedAfterRestoring) {
  Pipeline saved = Pipeline::create(mapping_rover(), without_delay(), ThreadPool(1)).value(),
           resumed = Pipeline::create(mapping_rover(), without_delay(), ThreadPool(1)).value();
  drive_to(saved, 0);
  add_wide_view(saved, 0);
  ASSERT_TRUE(saved.add(frame_of(images_of("narrow", 0), "narrow", 0, 1.5)).value().has_value());
  const testing::TemporaryFolder folder;
  Database db = Database::open(folder.path() + "/maps.sqlite", Database::Mode::create).value();
  TileStore tiles = TileStore::open(db).value();
  ASSERT_TRUE(resumed.restore(saved.save(), tiles));
  ASSERT_EQ(resumed.pending_frames().size(), 2);
  resumed.abandon_pending_frames();
  EXPECT_TRUE(resumed.pending_frames().empty());
  EXPECT_FALSE(drive_to(resumed, 1).stop) << "no map of the stop";
  add_wide_view(resumed, 1);
  EXPECT_TRUE(drive_to(resumed, 2).stop) << "one of the next";
}

void expect_same_map(const LocalMap& a, const LocalMap& b) {
  ASSERT_EQ(a.size(), b.size());
  int known = 0;
  for (int y = 0; y < a.size().height; ++y) {
    for (int x = 0; x < a.size().width; ++x) {
      ASSERT_EQ(a.count(x, y), b.count(x, y));
      if (!(a.count(x, y) > 0)) continue;
      ASSERT_EQ(a.elevation_m(x, y), b.elevation_m(x, y));
      ASSERT_EQ(a.variance_m2(x, y), b.variance_m2(x, y));
      ++known;
    }
  }
  EXPECT_GT(known, 100);
}

// More views than an eight-bit mask can distinguish, saved and restored between the ninth and the tenth.
TEST(PipelineMaps, StopMayHaveAnyNumberOfViews) {
  Pipeline uninterrupted = Pipeline::create(mapping_rover(), without_delay(), ThreadPool(1)).value(),
           resumed = Pipeline::create(mapping_rover(), without_delay(), ThreadPool(2)).value();
  drive_to(uninterrupted, 0);
  for (int i = 1; i <= 8; ++i) add_wide_view(uninterrupted, 0, 0.1 * i);
  ASSERT_TRUE(uninterrupted.add(frame_of(images_of("narrow", 0), "narrow", 0, 1)).value().has_value());
  const testing::TemporaryFolder folder;
  Database db = Database::open(folder.path() + "/maps.sqlite", Database::Mode::create).value();
  TileStore tiles = TileStore::open(db).value();
  ASSERT_TRUE(resumed.restore(uninterrupted.save(), tiles));
  const auto pending = resumed.pending_frames();
  ASSERT_EQ(pending.size(), 9U);
  for (const FrameKey& key : pending)
    ASSERT_TRUE(resumed.restore_frame(frame_of(images_of(key.pair, 0), key.pair, 0, key.left_stamp.seconds())));
  for (int i = 1; i <= 4; ++i) {
    add_wide_view(uninterrupted, 0, 1 + 0.1 * i);
    add_wide_view(resumed, 0, 1 + 0.1 * i);
  }
  const FrameResult one = drive_to(uninterrupted, 1), other = drive_to(resumed, 1);
  ASSERT_TRUE(one.stop && other.stop);
  EXPECT_EQ(one.stop->views, 13);
  EXPECT_EQ(other.stop->views, 13);
  expect_same_map(one.stop->merged.local, other.stop->merged.local);
  EXPECT_EQ(uninterrupted.save(), resumed.save());
}

// A pipeline with its own map store.
struct StoredRover {
  testing::TemporaryFolder folder;
  Database db = Database::open(folder.path() + "/maps.sqlite", Database::Mode::create).value();
  TileStore tiles = TileStore::open(db).value();
  Pipeline pipeline = Pipeline::create(mapping_rover(), without_delay(), ThreadPool(2)).value();

  // Maps the first stop and collects views of the second; then restores the state, so that map tiles are only in the
  // store.
  void drive_to_the_second_stop() {
    pipeline.store_maps_in(tiles);
    drive_to(pipeline, 0);
    add_wide_view(pipeline, 0);
    for (int i = 1; i < kFrames; ++i) drive_to(pipeline, i);
    add_wide_view(pipeline, kFrames - 1);
    ASSERT_TRUE(db.execute("BEGIN IMMEDIATE") && pipeline.flush_maps() && db.execute("COMMIT"));
    const Bytes memory = pipeline.save();
    pipeline = Pipeline::create(mapping_rover(), without_delay(), ThreadPool(2)).value();
    pipeline.store_maps_in(tiles);
    ASSERT_TRUE(pipeline.restore(memory, tiles));
    for (const FrameKey& key : pipeline.pending_frames()) {
      const auto& images = images_of(key.pair, kFrames - 1);
      ASSERT_TRUE(pipeline.restore_frame(frame_of(images, key.pair, kFrames - 1, key.left_stamp.seconds())));
    }
  }
  Result<std::optional<FrameResult>> leave_stop(double after_s) {
    const auto& images = images_of("narrow", kFrames - 1);
    return pipeline.add(frame_of(images, "narrow", kFrames, 3.0 * (kFrames - 1) + after_s));
  }
};

void expect_same(const FrameResult& a, const FrameResult& b) {
  EXPECT_EQ(a.world_from_body.pose.matrix(), b.world_from_body.pose.matrix());
  EXPECT_EQ(a.world_from_body.covariance, b.world_from_body.covariance);
  EXPECT_EQ(a.motion.from, b.motion.from);
  EXPECT_EQ(a.terrain.has_value(), b.terrain.has_value());
  ASSERT_EQ(a.stop.has_value(), b.stop.has_value());
  if (!a.stop) return;
  EXPECT_EQ(a.stop->position_id, b.stop->position_id);
  EXPECT_EQ(a.stop->views, b.stop->views);
  EXPECT_EQ(a.stop->merged.match.status, b.stop->merged.match.status);
  EXPECT_EQ(a.stop->merged.corrected.pose.matrix(), b.stop->merged.corrected.pose.matrix());
  expect_same_map(a.stop->merged.local, b.stop->merged.local);
}

TEST(PipelineMaps, DamagedTileLeavesStateUnchanged) {
  StoredRover damaged, intact;
  damaged.drive_to_the_second_stop();
  intact.drive_to_the_second_stop();
  ASSERT_EQ(damaged.pipeline.save(), intact.pipeline.save());
  // Every tile in turn: matching or fusion may be the first to read it.
  const auto count = [&] {
    auto select = damaged.db.prepare("SELECT count(*) FROM map_tiles");
    EXPECT_TRUE(select->step().value());
    return select->integer(0);
  }();
  int failures = 0;
  std::optional<Result<std::optional<FrameResult>>> finished;
  for (std::int64_t i = 0; i < count && failures < 3; ++i) {
    const std::string tile =
        "WHERE (submap, ix, iy) = (SELECT submap, ix, iy FROM map_tiles ORDER BY submap, ix, iy "
        "LIMIT 1 OFFSET " +
        std::to_string(i) + ")";
    ASSERT_TRUE(damaged.db.execute("UPDATE map_tiles SET checksum = checksum + 1 " + tile));
    auto result = damaged.leave_stop(1);
    ASSERT_TRUE(damaged.db.execute("UPDATE map_tiles SET checksum = checksum - 1 " + tile));
    if (result) {  // this tile is not read, so the stop was finished
      finished = std::move(result);
      break;
    }
    ++failures;
    EXPECT_EQ(result.error().code, ErrorCode::store_damaged);
    EXPECT_NE(result.error().message().find("is damaged"), std::string::npos);
    ASSERT_EQ(damaged.pipeline.save(), intact.pipeline.save()) << "tile " << i;
  }
  ASSERT_GT(failures, 0);
  const auto one = finished ? std::move(*finished) : damaged.leave_stop(1), other = intact.leave_stop(1);
  ASSERT_TRUE(one && *one && other && *other);
  ASSERT_TRUE((*one)->stop) << "the stop is not lost";
  expect_same(**one, **other);
  EXPECT_EQ(damaged.pipeline.save(), intact.pipeline.save());
}

TEST(PipelineMaps, FramesOfWrongSizeLeaveStateUnchanged) {
  Pipeline pipeline = Pipeline::create(mapping_rover(), without_delay(), ThreadPool(2)).value(),
           reference = Pipeline::create(mapping_rover(), without_delay(), ThreadPool(2)).value();
  const Image<std::uint8_t> cut(100, 100);
  const auto expect_rejected = [&](const char* pair, int position_id, double seconds) {
    StereoFrame frame = frame_of(images_of(pair, 0), pair, position_id, seconds);
    frame.right = FrameImage::borrow(cut.view(), {});
    const Bytes before = pipeline.save();
    const auto result = pipeline.add(frame);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::frame_rejected);
    EXPECT_EQ(pipeline.save(), before);
  };
  expect_rejected("wide", 0, -1);  // before the odometry frame of the stop
  expect_rejected("narrow", 0, -0.5);
  drive_to(pipeline, 0);
  drive_to(reference, 0);
  expect_rejected("wide", 0, 0.5);  // would have been the first view
  add_wide_view(pipeline, 0);
  add_wide_view(reference, 0);
  expect_rejected("wide", 0, 1.5);
  expect_rejected("narrow", 1, 2);  // of the next stop
  expect_same(drive_to(pipeline, 1), drive_to(reference, 1));
  EXPECT_EQ(pipeline.save(), reference.save());
}

TEST(PipelineMaps, EarlyViewsOfOnlyOneStopAreRetained) {
  Pipeline pipeline = Pipeline::create(mapping_rover(), without_delay(), ThreadPool(2)).value(),
           other = Pipeline::create(mapping_rover(), without_delay(), ThreadPool(2)).value();
  for (int id = 0; id < 4; ++id) {
    const StereoFrame view = frame_of(images_of("wide", 0), "wide", id, 5.0 * (id + 1));
    ASSERT_FALSE(pipeline.add(view).value().has_value());
  }
  const testing::TemporaryFolder folder;
  Database db = Database::open(folder.path() + "/maps.sqlite", Database::Mode::create).value();
  TileStore tiles = TileStore::open(db).value();
  ASSERT_TRUE(other.restore(pipeline.save(), tiles));
  ASSERT_EQ(other.pending_frames().size(), 1U) << "only of the latest stop";
  EXPECT_EQ(other.pending_frames()[0].left_stamp, Stamp::from_seconds(20));
}

TEST(PipelineMaps, OptionDisablesMaps) {
  RunOptions options;
  options.maps = false;
  Pipeline pipeline = Pipeline::create(mapping_rover(), options, ThreadPool(1)).value();
  drive_to(pipeline, 0);
  add_wide_view(pipeline, 0);
  EXPECT_FALSE(drive_to(pipeline, 1).stop);
  EXPECT_TRUE(pipeline.pending_frames().empty());
}

}  // namespace
}  // namespace spartan
