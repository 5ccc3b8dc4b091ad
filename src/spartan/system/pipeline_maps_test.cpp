// The pipeline where the rover stops and looks around.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "spartan/core/database.h"
#include "spartan/rig/rig.h"
#include "spartan/system/pipeline.h"
#include "spartan/testing/synthetic_world.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

const RectifiedStereo kWide{{320, 320}, 340, {159.5, 159.5}, 0.2};
const RectifiedStereo kNarrow{{320, 240}, 250, {159.5, 119.5}, 0.12};
constexpr double kStep_m = 0.15;
constexpr int kShots = 5;  // of the narrow pair; the wide one looks at the first and the last

// Wide cameras on a mast, 1 m high and 35° down, narrow ones at half a metre.
Rig rover() {
  const auto add = [](Rig& rig, const std::string& pair, const RectifiedStereo& stereo, const Pose& body_from_left) {
    for (const char* eye : {"left", "right"}) {
      Camera camera;
      camera.name = pair + "_" + eye;
      camera.size = stereo.size;
      camera.model = PinholeModel{stereo.focal_px, stereo.focal_px, stereo.centre_px.x(), stereo.centre_px.y()};
      camera.mount_from_camera =
          body_from_left * Pose::from_translation({eye == std::string("left") ? 0 : stereo.baseline_m, 0, 0});
      rig.cameras.push_back(camera);
    }
  };
  const auto looking = [](double height_m, double tilt_rad) {
    return Pose(exp_so3({0, tilt_rad, 0}), {0, 0, height_m}) * optical_from_forward().inverse();
  };
  Rig rig;
  rig.name = "rover";
  add(rig, "wide", kWide, looking(1, 0.6));
  add(rig, "narrow", kNarrow, looking(0.5, 0.55));
  rig.pairs = {{"wide", "wide_left", "wide_right", 0.6, false}, {"narrow", "narrow_left", "narrow_right", 0.4, true}};
  return rig;
}

Pose world_from_body(int shot) {
  return Pose::from_translation({kStep_m * shot, 0, 0});
}

// Rendered when they are asked for first.
const testing::SyntheticFrame& images_of(const std::string& pair, int shot) {
  static const testing::SyntheticWorld world = [] {
    testing::SyntheticWorldOptions options;
    options.relief_m = 0.03;
    options.stones_per_m2 = 6;
    options.stone_size_m = 0.2;
    return testing::SyntheticWorld(options);
  }();
  static std::map<std::pair<std::string, int>, testing::SyntheticFrame> rendered;
  const auto key = std::pair(pair, shot);
  const auto found = rendered.find(key);
  if (found != rendered.end()) return found->second;
  const Pose body_from_left = rover().body_from_camera(pair + "_left");
  return rendered
      .emplace(key, world.render(pair == "wide" ? kWide : kNarrow, world_from_body(shot) * body_from_left,
                                 static_cast<std::uint64_t>(pair == "wide" ? 100 + shot : shot)))
      .first->second;
}

StereoFrame frame_of(const testing::SyntheticFrame& images, const std::string& pair, int position, double seconds) {
  StereoFrame frame;
  frame.frame_id = position;
  frame.position_id = position;
  frame.pair = pair;
  frame.left_stamp = frame.right_stamp = Stamp::from_seconds(seconds);
  frame.left = FrameImage::borrow(images.left.view(), {});
  frame.right = FrameImage::borrow(images.right.view(), {});
  return frame;
}

FrameResult drive_to(Pipeline& pipeline, int shot) {
  return pipeline.add(frame_of(images_of("narrow", shot), "narrow", shot, 3.0 * shot)).value().value();
}
void look_around(Pipeline& pipeline, int shot, double after_s = 1) {
  ASSERT_FALSE(pipeline.add(frame_of(images_of("wide", shot), "wide", shot, 3.0 * shot + after_s)).value().has_value());
}

TEST(PipelineMaps, PositionsBecomeMapsThatAreFoundInEachOther) {
  Pipeline pipeline = Pipeline::create(rover(), {}, ThreadPool(2)).value();
  EXPECT_FALSE(drive_to(pipeline, 0).position);
  look_around(pipeline, 0);
  const FrameResult left = drive_to(pipeline, 1);
  ASSERT_TRUE(left.position) << "the first position is known when the rover has gone on";
  EXPECT_EQ(left.position->position_id, 0);
  EXPECT_EQ(left.position->views, 2) << "the narrow shot is one of its views";
  EXPECT_EQ(left.position->merged.match.status, MatchStatus::no_overlap);
  for (int i = 2; i < kShots; ++i) EXPECT_FALSE(drive_to(pipeline, i).position) << "nobody looked around";
  look_around(pipeline, kShots - 1);
  const auto last = pipeline.leave_position().value();
  ASSERT_TRUE(last);
  ASSERT_EQ(last->merged.match.status, MatchStatus::decided) << "60 cm on, most of the ground is known";
  EXPECT_GT(last->merged.match.overlap, 0.4);
  EXPECT_LT((last->merged.corrected.pose.translation() - world_from_body(kShots - 1).translation()).norm(), 0.015);
  ASSERT_TRUE(last->merged.constraint);
  EXPECT_EQ(last->merged.constraint->stamp, Stamp::from_seconds(3.0 * (kShots - 1)));
  EXPECT_FALSE(pipeline.leave_position().value()) << "a position is left once";
}

TEST(PipelineMaps, TheMapIsHeardByTheLocalization) {
  Pipeline pipeline = Pipeline::create(rover(), {}, ThreadPool(2)).value();
  FrameResult result = drive_to(pipeline, 0);
  look_around(pipeline, 0);
  for (int i = 1; i < kShots; ++i) result = drive_to(pipeline, i);
  EXPECT_EQ(result.localization->health_of(LocalizationSensor::map).state, SensorState::missing);
  look_around(pipeline, kShots - 1);
  // The next position: what the last one said comes with it.
  StereoFrame next = frame_of(images_of("narrow", kShots - 1), "narrow", kShots, 3.0 * kShots);
  result = pipeline.add(next).value().value();
  ASSERT_TRUE(result.position);
  EXPECT_EQ(result.localization->health_of(LocalizationSensor::map).state, SensorState::ok);
  EXPECT_EQ(result.localization->health_of(LocalizationSensor::map).used, 1);
  // The correction shows in the slam pose too, which else is the odometry's.
  const Eigen::Vector3d corrected = result.position->merged.corrected.pose.translation();
  EXPECT_GT((corrected - result.world_from_body.pose.translation()).norm(), 1e-6);
  EXPECT_LT((result.slam->pose.translation() - corrected).norm(), 1e-8) << "it has stood since";
}

// As recordings with a fast narrow pair have it: at 4 Hz through the whole stop, the pans in between, minutes long. And
// the ground gives way meanwhile, so the rover ends a step farther on.
TEST(PipelineMaps, AStopMayBeLongAndTheOdometrysPairMayLookOn) {
  for (const double buffer_s : {0.5, 300.0}) {
    SCOPED_TRACE(buffer_s);
    RunOptions options;
    options.localization.buffer_s = buffer_s;
    Pipeline pipeline = Pipeline::create(rover(), options, ThreadPool(2)).value();
    FrameResult result = drive_to(pipeline, 0);
    look_around(pipeline, 0);
    for (int i = 1; i < kShots; ++i) result = drive_to(pipeline, i);
    const auto again = [&](int shot, int position, double seconds) {
      return pipeline.add(frame_of(images_of("narrow", shot), "narrow", position, seconds)).value().value();
    };
    look_around(pipeline, kShots - 1);
    const double arrived = 3.0 * (kShots - 1);
    EXPECT_FALSE(again(kShots, kShots - 1, arrived + 1.5).position) << "it is the same position";
    const FrameResult before = again(kShots, kShots - 1, arrived + 1.8);
    EXPECT_FALSE(before.position);
    pipeline.add(WheelSample{Stamp::from_seconds(arrived + 10), 0.6, 0.6});
    result = again(kShots, kShots, arrived + 11);
    ASSERT_TRUE(result.position);
    EXPECT_EQ(result.position->views, 2) << "the narrow pair's first look and the wide pair's";
    EXPECT_EQ(result.position->stamp, Stamp::from_seconds(arrived));
    EXPECT_EQ(result.localization->health_of(LocalizationSensor::map).used, 1);
    EXPECT_EQ(result.localization->health_of(LocalizationSensor::map).refused.too_late, 0);
    const Eigen::Vector3d truth = world_from_body(kShots).translation();
    EXPECT_LT((result.localization->world_from_body.pose.translation() - truth).norm(), 0.015);
    EXPECT_LT((result.slam->pose.translation() - truth).norm(), 0.015);
    const auto since = [](const UncertainPose& a, const UncertainPose& b) { return a.pose.inverse() * b.pose; };
    const Pose slam = since(*before.slam, *result.slam),
               odometry = since(before.world_from_body, result.world_from_body);
    EXPECT_GT(log_se3(odometry.inverse() * slam).norm(), 1e-7) << "the map was heard";
  }
}

TEST(PipelineMaps, AViewMayComeBeforeTheOdometrysShot) {
  Pipeline pipeline = Pipeline::create(rover(), {}, ThreadPool(2)).value();
  look_around(pipeline, 0, -1);
  look_around(pipeline, 0, -0.5);
  EXPECT_FALSE(drive_to(pipeline, 0).position);
  const FrameResult left = drive_to(pipeline, 1);
  ASSERT_TRUE(left.position);
  EXPECT_EQ(left.position->position_id, 0);
  EXPECT_EQ(left.position->views, 3) << "both looks, and the narrow shot";
  // Of a position that the odometry's next shot is not at.
  look_around(pipeline, 3, -4.5);
  drive_to(pipeline, 2);
  EXPECT_FALSE(drive_to(pipeline, 3).position);
  EXPECT_FALSE(pipeline.leave_position().value());
}

// Stopped between two looks of the wide pair, at a shot of the narrow one.
TEST(PipelineMaps, AStopGoesOnFromRestoredMemory) {
  Pipeline straight = Pipeline::create(rover(), {}, ThreadPool(1)).value(),
           later = Pipeline::create(rover(), {}, ThreadPool(2)).value();
  drive_to(straight, 0);
  look_around(straight, 0);
  ASSERT_TRUE(straight.add(frame_of(images_of("narrow", 0), "narrow", 0, 1.5)).value().has_value());
  const testing::TemporaryFolder folder;
  Database db = Database::open(folder.path() + "/maps.sqlite", Database::Mode::create).value();
  TileStore tiles = TileStore::open(db).value();
  ASSERT_TRUE(later.restore(straight.save(), tiles));
  const auto wanted = later.wanted_shots();
  ASSERT_EQ(wanted.size(), 2);
  EXPECT_EQ(wanted[0].pair, "narrow");
  EXPECT_EQ(wanted[0].left_stamp, Stamp::from_seconds(0)) << "the first shot there is the one that is a view";
  EXPECT_EQ(wanted[1].pair, "wide");
  for (const FrameKey& shot : wanted)
    ASSERT_TRUE(later.recall(frame_of(images_of(shot.pair, 0), shot.pair, 0, shot.left_stamp.seconds())));
  EXPECT_TRUE(later.wanted_shots().empty());
  EXPECT_EQ(straight.save(), later.save());
  look_around(straight, 0, 2);
  look_around(later, 0, 2);
  const FrameResult one = drive_to(straight, 1), other = drive_to(later, 1);
  ASSERT_TRUE(one.position && other.position);
  EXPECT_EQ(straight.save(), later.save()) << "nothing is left of the stop";
  EXPECT_TRUE(straight.wanted_shots().empty());
  EXPECT_EQ(one.position->views, 3);
  EXPECT_EQ(other.position->views, 3);
  const LocalMap &a = one.position->merged.local, &b = other.position->merged.local;
  for (int y = 0; y < a.size().height; ++y) {
    for (int x = 0; x < a.size().width; ++x) {
      ASSERT_EQ(a.count(x, y), b.count(x, y));
      if (!(a.count(x, y) > 0)) continue;
      ASSERT_EQ(a.elevation_m(x, y), b.elevation_m(x, y));
    }
  }
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

// More views than a mask of eight bits can tell apart, saved and restored between the ninth and the tenth.
TEST(PipelineMaps, AStopMayHaveAnyNumberOfViews) {
  Pipeline straight = Pipeline::create(rover(), {}, ThreadPool(1)).value(),
           later = Pipeline::create(rover(), {}, ThreadPool(2)).value();
  drive_to(straight, 0);
  for (int i = 1; i <= 8; ++i) look_around(straight, 0, 0.1 * i);
  ASSERT_TRUE(straight.add(frame_of(images_of("narrow", 0), "narrow", 0, 1)).value().has_value());
  const testing::TemporaryFolder folder;
  Database db = Database::open(folder.path() + "/maps.sqlite", Database::Mode::create).value();
  TileStore tiles = TileStore::open(db).value();
  ASSERT_TRUE(later.restore(straight.save(), tiles));
  const auto wanted = later.wanted_shots();
  ASSERT_EQ(wanted.size(), 9U);
  for (const FrameKey& shot : wanted)
    ASSERT_TRUE(later.recall(frame_of(images_of(shot.pair, 0), shot.pair, 0, shot.left_stamp.seconds())));
  for (int i = 1; i <= 4; ++i) {
    look_around(straight, 0, 1 + 0.1 * i);
    look_around(later, 0, 1 + 0.1 * i);
  }
  const FrameResult one = drive_to(straight, 1), other = drive_to(later, 1);
  ASSERT_TRUE(one.position && other.position);
  EXPECT_EQ(one.position->views, 13);
  EXPECT_EQ(other.position->views, 13);
  expect_same_map(one.position->merged.local, other.position->merged.local);
  EXPECT_EQ(straight.save(), later.save());
}

// A pipeline over a store of its own.
struct StoredRover {
  testing::TemporaryFolder folder;
  Database db = Database::open(folder.path() + "/maps.sqlite", Database::Mode::create).value();
  TileStore tiles = TileStore::open(db).value();
  Pipeline pipeline = Pipeline::create(rover(), {}, ThreadPool(2)).value();

  // One mapped stop behind, another one at hand; then from restored memory, so that the map's tiles are in the store
  // alone.
  void drive_to_the_second_stop() {
    pipeline.page_maps_to(tiles);
    drive_to(pipeline, 0);
    look_around(pipeline, 0);
    for (int i = 1; i < kShots; ++i) drive_to(pipeline, i);
    look_around(pipeline, kShots - 1);
    ASSERT_TRUE(db.execute("BEGIN IMMEDIATE") && pipeline.flush_maps() && db.execute("COMMIT"));
    const Bytes memory = pipeline.save();
    pipeline = Pipeline::create(rover(), {}, ThreadPool(2)).value();
    pipeline.page_maps_to(tiles);
    ASSERT_TRUE(pipeline.restore(memory, tiles));
    for (const FrameKey& shot : pipeline.wanted_shots()) {
      const auto& images = images_of(shot.pair, kShots - 1);
      ASSERT_TRUE(pipeline.recall(frame_of(images, shot.pair, kShots - 1, shot.left_stamp.seconds())));
    }
  }
  Result<std::optional<FrameResult>> leave(double after_s) {
    const auto& images = images_of("narrow", kShots - 1);
    return pipeline.add(frame_of(images, "narrow", kShots, 3.0 * (kShots - 1) + after_s));
  }
};

void expect_same(const FrameResult& a, const FrameResult& b) {
  EXPECT_EQ(a.world_from_body.pose.matrix(), b.world_from_body.pose.matrix());
  EXPECT_EQ(a.world_from_body.covariance, b.world_from_body.covariance);
  EXPECT_EQ(a.motion.from, b.motion.from);
  EXPECT_EQ(a.terrain.has_value(), b.terrain.has_value());
  ASSERT_EQ(a.position.has_value(), b.position.has_value());
  if (!a.position) return;
  EXPECT_EQ(a.position->position_id, b.position->position_id);
  EXPECT_EQ(a.position->views, b.position->views);
  EXPECT_EQ(a.position->merged.match.status, b.position->merged.match.status);
  EXPECT_EQ(a.position->merged.corrected.pose.matrix(), b.position->merged.corrected.pose.matrix());
  expect_same_map(a.position->merged.local, b.position->merged.local);
}

TEST(PipelineMaps, ADamagedTileAdvancesNothing) {
  StoredRover damaged, sound;
  damaged.drive_to_the_second_stop();
  sound.drive_to_the_second_stop();
  ASSERT_EQ(damaged.pipeline.save(), sound.pipeline.save());
  // Every tile in turn: the view that is matched, and the cells that are fused, may meet it first.
  const auto count = [&] {
    auto select = damaged.db.prepare("SELECT count(*) FROM map_tiles");
    EXPECT_TRUE(select->step().value());
    return select->integer(0);
  }();
  int met = 0;
  for (std::int64_t i = 0; i < count && met < 3; ++i) {
    const std::string tile =
        "WHERE (submap, ix, iy) = (SELECT submap, ix, iy FROM map_tiles ORDER BY submap, ix, iy "
        "LIMIT 1 OFFSET " +
        std::to_string(i) + ")";
    ASSERT_TRUE(damaged.db.execute("UPDATE map_tiles SET checksum = checksum + 1 " + tile));
    const auto failed = damaged.leave(1);
    ASSERT_TRUE(damaged.db.execute("UPDATE map_tiles SET checksum = checksum - 1 " + tile));
    if (failed) break;  // beyond what is loaded
    ++met;
    EXPECT_EQ(failed.error().code, ErrorCode::store_damaged);
    EXPECT_NE(failed.error().message().find("is damaged"), std::string::npos);
    ASSERT_EQ(damaged.pipeline.save(), sound.pipeline.save()) << "tile " << i;
  }
  ASSERT_GT(met, 0);
  const auto one = damaged.leave(2), other = sound.leave(2);
  ASSERT_TRUE(one && *one && other && *other);
  ASSERT_TRUE((*one)->position) << "the stop is not lost";
  expect_same(**one, **other);
  EXPECT_EQ(damaged.pipeline.save(), sound.pipeline.save());
}

TEST(PipelineMaps, FramesOfTheWrongSizeAtAStopAdvanceNothing) {
  Pipeline seeing = Pipeline::create(rover(), {}, ThreadPool(2)).value(),
           sparing = Pipeline::create(rover(), {}, ThreadPool(2)).value();
  const Image<std::uint8_t> cut(100, 100);
  const auto refused = [&](const char* pair, int position, double seconds) {
    StereoFrame frame = frame_of(images_of(pair, 0), pair, position, seconds);
    frame.right = FrameImage::borrow(cut.view(), {});
    const Bytes before = seeing.save();
    const auto result = seeing.add(frame);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::frame_rejected);
    EXPECT_EQ(seeing.save(), before);
  };
  refused("wide", 0, -1);  // before the odometry's frame there
  refused("narrow", 0, -0.5);
  drive_to(seeing, 0);
  drive_to(sparing, 0);
  refused("wide", 0, 0.5);  // would have been the first view
  look_around(seeing, 0);
  look_around(sparing, 0);
  refused("wide", 0, 1.5);
  refused("narrow", 1, 2);  // of the next position
  expect_same(drive_to(seeing, 1), drive_to(sparing, 1));
  EXPECT_EQ(seeing.save(), sparing.save());
}

TEST(PipelineMaps, ViewsDoNotPileUpWhereTheOdometryIsDark) {
  Pipeline pipeline = Pipeline::create(rover(), {}, ThreadPool(2)).value(),
           other = Pipeline::create(rover(), {}, ThreadPool(2)).value();
  for (int position = 0; position < 4; ++position) {
    const StereoFrame look = frame_of(images_of("wide", 0), "wide", position, 5.0 * (position + 1));
    ASSERT_FALSE(pipeline.add(look).value().has_value());
  }
  const testing::TemporaryFolder folder;
  Database db = Database::open(folder.path() + "/maps.sqlite", Database::Mode::create).value();
  TileStore tiles = TileStore::open(db).value();
  ASSERT_TRUE(other.restore(pipeline.save(), tiles));
  ASSERT_EQ(other.wanted_shots().size(), 1U) << "of the newest position alone";
  EXPECT_EQ(other.wanted_shots()[0].left_stamp, Stamp::from_seconds(20));
}

TEST(PipelineMaps, AreSwitchedOffByOption) {
  RunOptions options;
  options.maps = false;
  Pipeline pipeline = Pipeline::create(rover(), options, ThreadPool(1)).value();
  drive_to(pipeline, 0);
  look_around(pipeline, 0);
  EXPECT_FALSE(drive_to(pipeline, 1).position);
  EXPECT_TRUE(pipeline.wanted_shots().empty());
}

}  // namespace
}  // namespace spartan
