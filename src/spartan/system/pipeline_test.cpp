#include "spartan/system/pipeline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "spartan/system/internal/rendered_drive_test.h"

namespace spartan {

using namespace rendered_drive;

namespace {

TEST(Pipeline, TracksMotionFromImagesInMemory) {
  Pipeline pipeline = pipeline_of();
  FrameResult last;
  for (int i = 0; i < 5; ++i) last = push(pipeline, i);
  EXPECT_EQ(last.frame_id, 4);
  EXPECT_EQ(last.stamp.ns, 4'000'000'000LL);
  EXPECT_LT((last.world_from_body.pose.translation() - world_from_body(4).translation()).norm(), 0.002);
  EXPECT_LT(log_so3(last.world_from_body.pose.rotation()).norm(), 0.005);
  EXPECT_GT(last.world_from_body.covariance.trace(), 0);
  EXPECT_FALSE(pipeline.gravity_measured());
}

// The pair of the odometry on a mast that pans while the rover drives. Its angles must not end up in the rover's
// motion.
TEST(Pipeline, TracksMotionWithAPanningMast) {
  Rig rig = rover();
  PanTiltUnit mast;
  mast.body_from_base = Pose::from_translation({0.1, 0, kHeight_m});
  rig.pan_tilt_units = {mast};
  for (Camera& camera : rig.cameras) {
    camera.mount = mast.name;
    camera.mount_from_camera = mast.body_from_base.inverse() * camera.mount_from_camera;
  }
  const testing::SyntheticWorld world(testing::SyntheticWorldOptions{});
  Pipeline pipeline = Pipeline::create(rig, {}, ThreadPool(1)).value();
  const std::vector<double> pan_rad{0, 0.1, -0.1, 0.25, 0.25};
  for (std::size_t i = 0; i < pan_rad.size(); ++i) {
    const int index = static_cast<int>(i);
    const Pose world_from_left = world_from_body(index) * rig.body_from_camera("left", pan_rad[i], 0);
    const SyntheticFrame images = world.render(kStereo, world_from_left, i);
    StereoFrame frame = frame_at(index);
    frame.pan_rad = pan_rad[i];
    frame.left = FrameImage::borrow(images.left.view(), {});
    frame.right = FrameImage::borrow(images.right.view(), {});
    const FrameResult result = pipeline.add(frame).value().value();
    if (i == 0) continue;
    EXPECT_EQ(result.motion.status, TrackingStatus::tracking) << i << ": " << result.motion.reason;
    for (const Pose& pose : {result.world_from_body.pose, result.localization->world_from_body.pose}) {
      EXPECT_LT((pose.translation() - world_from_body(index).translation()).norm(), 0.003) << i;
      EXPECT_LT(log_so3(pose.rotation()).norm(), 0.005) << i;
    }
  }
}

TEST(Pipeline, FirstFrameHasTerrain) {
  RunOptions options;
  options.terrain.delay_frames = 0;
  Pipeline pipeline = pipeline_of(options);
  const FrameResult first = push(pipeline, 0);
  ASSERT_TRUE(first.terrain);
  int known = 0, correct = 0;
  for (int y = 0; y < 240; y += 3) {
    for (int x = 0; x < 320; x += 3) {
      const float measured = first.terrain->disparity(x, y);
      if (std::isnan(measured) || rendered_frames()[0].mask(x, y) != 255) continue;
      ++known;
      correct += std::abs(measured - rendered_frames()[0].disparity(x, y)) < 1 ? 1 : 0;
    }
  }
  EXPECT_GT(known, 5000);
  EXPECT_GT(correct, 0.95 * known);
  // A triangulated point lies on the ground.
  const RectifiedStereo& geometry = first.terrain->geometry;
  const Eigen::Vector3d in_left = geometry.triangulate(160, 200, first.terrain->disparity(160, 200));
  const Eigen::Vector3d point = first.terrain->world_from_left * in_left;
  EXPECT_NEAR(point.z(), 0, 0.2);
  EXPECT_FALSE(push(pipeline, 1).terrain) << "the next one is due after five metres";
}

TEST(Pipeline, DenseDisparitiesAreSharedByOdometryAndTerrain) {
  RunOptions options;
  options.terrain.every_m = 0;  // terrain for every frame
  options.terrain.delay_frames = 0;
  Pipeline row = pipeline_of(options);
  const auto set = set_option(options, "odometry.reconstruction.source=dense");
  ASSERT_TRUE(set) << set.error().message();
  Pipeline dense = pipeline_of(*set);
  for (int i = 0; i < 3; ++i) {
    const FrameResult by_row = push(row, i), by_dense = push(dense, i);
    ASSERT_TRUE(by_row.terrain && by_dense.terrain);
    EXPECT_EQ(std::count_if(by_dense.times.begin(), by_dense.times.end(),
                            [](const StageTime& time) { return time.stage == "reconstruction"; }),
              1)
        << "one dense disparity image serves odometry and terrain";
    if (i > 0) {
      EXPECT_NE(by_row.motion.previous_from_current.translation(), by_dense.motion.previous_from_current.translation());
      EXPECT_EQ(by_dense.motion.status, TrackingStatus::tracking);
      EXPECT_NEAR(by_dense.world_from_body.pose.translation().x(), i * kStep_m, 0.005);
    }
    for (int y = 0; y < 240; ++y) {
      for (int x = 0; x < 320; ++x) {
        const float a = by_row.terrain->disparity(x, y), b = by_dense.terrain->disparity(x, y);
        ASSERT_TRUE(a == b || (std::isnan(a) && std::isnan(b))) << x << " " << y;
      }
    }
  }
}

TEST(Pipeline, RestoredStateGivesTheSameResults) {
  Pipeline uninterrupted = pipeline_of();
  for (int i = 0; i < 3; ++i) push(uninterrupted, i);
  Pipeline resumed = pipeline_of({}, 2);
  EmptyMaps maps;
  ASSERT_TRUE(resumed.restore(uninterrupted.save(), maps.tiles));
  for (int i = 3; i < 5; ++i) {
    const FrameResult one = push(uninterrupted, i), other = push(resumed, i);
    EXPECT_EQ(one.world_from_body.pose.translation(), other.world_from_body.pose.translation());
    EXPECT_EQ(one.world_from_body.covariance, other.world_from_body.covariance);
    EXPECT_EQ(one.terrain.has_value(), other.terrain.has_value());
  }
  EXPECT_EQ(uninterrupted.save(), resumed.save());
}

TEST(Pipeline, RejectsInvalidState) {
  Pipeline pipeline = pipeline_of();
  push(pipeline, 0);
  EmptyMaps maps;
  Bytes state = pipeline.save();
  state.resize(state.size() / 2);
  EXPECT_FALSE(pipeline.restore(state, maps.tiles));
  state = pipeline.save();
  state[0] = 99;
  const Status refused = pipeline.restore(state, maps.tiles);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::configuration);
}

TEST(Pipeline, PredictsWithConstantVelocity) {
  Pipeline pipeline = pipeline_of();
  EXPECT_FALSE(pipeline.predict({0}));
  for (int i = 0; i < 3; ++i) push(pipeline, i);
  const auto predicted = pipeline.predict(Stamp{2'500'000'000LL});
  ASSERT_TRUE(predicted);
  EXPECT_NEAR(predicted->translation().x(), 2.5 * kStep_m, 0.003);
}

TEST(Pipeline, AlignsWithGravityBeforeTheFirstFrame) {
  Pipeline pipeline = pipeline_of();
  const double tilt = 0.1;  // nose up
  for (int i = 0; i < 50; ++i) {
    pipeline.add(ImuSample{{i * 10'000'000LL}, {0, 0, 0}, 9.81 * Eigen::Vector3d(std::sin(tilt), 0, std::cos(tilt))});
  }
  const FrameResult first = push(pipeline, 1);  // a second later
  EXPECT_TRUE(pipeline.gravity_measured());
  EXPECT_NEAR((first.world_from_body.pose.rotation() * Eigen::Vector3d::UnitX()).z(), std::sin(tilt), 1e-9);
}

// As in a recording whose IMU starts together with the camera.
TEST(Pipeline, AlignsWithGravityFromSamplesAfterTheFirstFrame) {
  Pipeline pipeline = pipeline_of();
  const double tilt = 0.1;
  std::vector<ImuSample> first_second;
  first_second.reserve(50);
  for (int i = 0; i < 50; ++i)
    first_second.push_back({{i * 10'000'000LL}, {0, 0, 0}, 9.81 * Eigen::Vector3d(std::sin(tilt), 0, std::cos(tilt))});
  pipeline.align_with_gravity(first_second);
  const FrameResult first = push(pipeline, 0);
  EXPECT_TRUE(pipeline.gravity_measured());
  EXPECT_NEAR((first.world_from_body.pose.rotation() * Eigen::Vector3d::UnitX()).z(), std::sin(tilt), 1e-9);
}

TEST(Pipeline, OdometryOnlyGivesTheSamePoses) {
  RunOptions options, alone_options;
  // The filters do not know that the errors of the calibration are the same in all motions.
  options.mapping.map.calibration = {{0, 0, 0, 0, 0}};
  alone_options = options;
  alone_options.odometry_only = true;
  Pipeline whole = pipeline_of(options), alone = pipeline_of(alone_options), resumed = pipeline_of(alone_options, 2);
  for (Pipeline* pipeline : {&whole, &alone}) {
    for (int i = 0; i < 50; ++i) {
      pipeline->add(ImuSample{{i * 10'000'000LL - 500'000'000LL}, {0, 0, 0}, 9.81 * Eigen::Vector3d(0.1, 0, 0.99)});
      pipeline->add(CompassSample{{i * 10'000'000LL - 500'000'000LL}, 0.5, 0.01});
    }
  }
  EmptyMaps maps;
  for (int i = 0; i < 5; ++i) {
    if (i == 3) {
      ASSERT_TRUE(resumed.restore(alone.save(), maps.tiles));
    }
    const FrameResult all = push(whole, i), one = push(alone, i);
    EXPECT_EQ(one.world_from_body.pose.matrix(), all.world_from_body.pose.matrix());
    for (int k = 0; k < 6 && i > 0; ++k) {
      const double expected = all.world_from_body.covariance(k, k);
      EXPECT_NEAR(one.world_from_body.covariance(k, k), expected, 0.05 * expected + 1e-11) << i << ", " << k;
    }
    EXPECT_FALSE(one.slam || one.localization || one.terrain || one.stop);
    EXPECT_TRUE(all.slam && all.localization);
    for (const StageTime& time : one.times)
      EXPECT_TRUE(time.stage.starts_with("imaging") || time.stage == "odometry") << time.stage;
    if (i < 3) continue;
    const FrameResult again = push(resumed, i);
    EXPECT_EQ(again.world_from_body.pose.matrix(), one.world_from_body.pose.matrix());
    EXPECT_EQ(again.world_from_body.covariance, one.world_from_body.covariance);
  }
  EXPECT_EQ(alone.save(), resumed.save());
  EXPECT_TRUE(alone.gravity_measured());
  EXPECT_TRUE(alone.heading_east());
}

TEST(Pipeline, FramesOfOtherPairsHaveNoResult) {
  Pipeline pipeline = pipeline_of();
  EXPECT_EQ(pipeline.odometry_pair(), "narrow");
  StereoFrame wide = frame_at(0);
  wide.pair = "wide";
  const auto result = pipeline.add(wide);
  ASSERT_TRUE(result);
  EXPECT_FALSE(result->has_value());
}

TEST(Pipeline, RequiresAPairForTheOdometry) {
  RunOptions options;
  options.odometry_pair = "rear";
  const auto unknown = Pipeline::create(rover(), options, ThreadPool(1));
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::configuration);
  Rig only_wide = rover();
  only_wide.pairs.pop_back();
  EXPECT_FALSE(Pipeline::create(only_wide, {}, ThreadPool(1)));
}

TEST(Pipeline, RejectsOptionsOutOfBounds) {
  RunOptions options;
  options.reconstruction.p2_flat = 300;
  options.mapping.v_disparity.strips = 0;
  options.mapping.map.cell_m = 0;
  options.terrain.every_m = std::numeric_limits<double>::quiet_NaN();
  options.imaging.contrast_high_percent = 101;
  options.localization.vision.drift_sigma_ratios = {1, 2, 3};
  const auto refused = Pipeline::create(rover(), options, ThreadPool(1));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::configuration);
  for (const char* field : {"reconstruction.p2_flat is 300", "strips is 0", "mapping.map.cell_m is 0",
                            "terrain.every_m must be a finite number", "imaging.contrast_high_percent is 101",
                            "localization.vision.drift_sigma_ratios has 3 numbers, must have 6"})
    EXPECT_NE(refused.error().message().find(field), std::string::npos) << field;
}

// A state with a valid checksum may come from anyone.
TEST(Pipeline, AStateWhoseStagesHaveNotAllStartedIsDamaged) {
  Pipeline pipeline = pipeline_of();
  push(pipeline, 0);
  Bytes state = pipeline.save();
  constexpr std::size_t kStarted = 4;  // behind the version
  ASSERT_EQ(state[kStarted], 1);
  state[kStarted] = 0;
  EmptyMaps maps;
  Pipeline restored = pipeline_of();
  const Status status = restored.restore(state, maps.tiles);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::store_damaged);
}

}  // namespace
}  // namespace spartan
