// Frames that are lost or refused.
#include <gtest/gtest.h>

#include "spartan/system/internal/rendered_drive_test.h"
#include "spartan/system/pipeline.h"

namespace spartan {

using namespace rendered_drive;

namespace {

// A dark frame: the poses before and after it are as accurate as without it.
TEST(PipelineFaults, ADarkFrameCostsNothing) {
  const Image<std::uint8_t> dark(320, 240, 2);
  for (const bool odometry_only : {false, true}) {
    RunOptions options;
    options.odometry_only = odometry_only;
    Pipeline pipeline = pipeline_of(options);
    for (int i = 0; i < 5; ++i) {
      StereoFrame frame = frame_at(i);
      if (i == 3) frame.left = frame.right = FrameImage::borrow(dark.view(), {});
      const FrameResult result = pipeline.add(frame).value().value();
      if (i == 0) continue;
      EXPECT_EQ(result.motion.status, i == 3 ? TrackingStatus::lost : TrackingStatus::tracking) << i;
      if (i == 3) continue;
      const UncertainPose pose = odometry_only ? result.world_from_body : result.localization->world_from_body;
      EXPECT_LT((pose.pose.translation() - world_from_body(i).translation()).norm(), 0.003) << i;
      EXPECT_LT(pose.covariance.diagonal().head(3).sum(), 1e-4) << i;
    }
  }
}

// A missing image: the motion is measured in the other one, and neither a map nor a view of the terrain is made.
TEST(PipelineFaults, AMissingImageCostsLittle) {
  for (const bool left : {false, true}) {
    RunOptions options;
    options.keyframes.every_m = 0.04;
    options.terrain.every_m = 0.01;
    options.terrain.delay_frames = 0;
    Pipeline pipeline = pipeline_of(options);
    for (int i = 0; i < 5; ++i) {
      StereoFrame frame = frame_at(i);
      if (i == 3) (left ? frame.left : frame.right) = {};
      const FrameResult result = pipeline.add(frame).value().value();
      if (i == 0) continue;
      EXPECT_EQ(result.motion.status, i == 3 ? TrackingStatus::degraded : TrackingStatus::tracking) << i;
      EXPECT_EQ(result.terrain.has_value(), i != 3) << i;
      const UncertainPose& pose = result.localization->world_from_body;
      EXPECT_LT((pose.pose.translation() - world_from_body(i).translation()).norm(), 0.003) << i;
    }
  }
}

// The rover turns by 46° while a dark frame is lost. Without the IMU the landmarks would not be found again. Live, its
// samples come before an image of the same time.
TEST(PipelineFaults, SensorsBridgeALostFrame) {
  constexpr double kRate_rad_s = 0.4;
  const Pose turned = world_from_body(4) * Pose(exp_so3({0, 0, 2 * kRate_rad_s}), {0, 0, 0});
  const testing::SyntheticWorld world(testing::SyntheticWorldOptions{});
  const SyntheticFrame images = world.render(kStereo, turned * rover().body_from_camera("left"), 4);
  const Image<std::uint8_t> dark(320, 240, 2);
  constexpr int kNone = -1;
  for (const int samples_ahead : {kNone, 0, 8}) {
    SCOPED_TRACE(samples_ahead);
    const bool with_imu = samples_ahead != kNone;
    Pipeline pipeline = pipeline_of();
    if (with_imu) pipeline.add(CompassSample{{-10'000'000LL}, 0.8, 0.01});  // the pose at the start is not the identity
    Pose first;
    int samples = -100;
    for (int i = 0; i < 5; ++i) {
      for (; with_imu && samples <= 100 * i + (i > 0 ? samples_ahead : 0); ++samples) {
        const double rate = samples > 200 ? kRate_rad_s : 0;
        const double noise = 1e-4 * (samples % 7);  // an IMU that repeats its readings is excluded
        pipeline.add(ImuSample{{samples * 10'000'000LL}, {noise, 0, rate}, {0, noise, 9.81}});
      }
      StereoFrame frame = frame_at(i);
      if (i == 3) frame.left = frame.right = FrameImage::borrow(dark.view(), {});
      if (i == 4) {
        frame.left = FrameImage::borrow(images.left.view(), {});
        frame.right = FrameImage::borrow(images.right.view(), {});
      }
      const FrameResult result = pipeline.add(frame).value().value();
      if (i == 0) first = result.world_from_body.pose;
      if (i < 4) continue;
      EXPECT_EQ(result.motion.status == TrackingStatus::lost, !with_imu) << result.motion.reason;
      if (!with_imu) continue;
      EXPECT_EQ(result.motion.from, frame_at(2).left_stamp);
      EXPECT_LT((turned.inverse() * (first.inverse() * result.world_from_body.pose)).translation().norm(), 0.005);
    }
  }
}

TEST(PipelineFaults, RejectsFramesThatDoNotFitTheRigAndContinues) {
  Pipeline pipeline = pipeline_of();
  push(pipeline, 0);
  StereoFrame unknown_pair = frame_at(1);
  unknown_pair.pair = "rear";
  const auto unknown = pipeline.add(unknown_pair);
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::frame_rejected);
  EXPECT_NE(unknown.error().message().find("rear"), std::string::npos);
  StereoFrame small = frame_at(1);
  const Image<std::uint8_t> cut(100, 100);
  small.right = FrameImage::borrow(cut.view(), {});
  const auto unfit = pipeline.add(small);
  ASSERT_FALSE(unfit);
  EXPECT_EQ(unfit.error().code, ErrorCode::frame_rejected);
  EXPECT_EQ(pipeline.fault_of(small), FrameFault::wrong_size);
  EXPECT_NEAR(push(pipeline, 1).world_from_body.pose.translation().x(), kStep_m, 0.002);
}

TEST(PipelineFaults, RejectsImagesThatRepeatBitForBit) {
  Pipeline pipeline = pipeline_of();
  push(pipeline, 0);
  push(pipeline, 1);
  const Bytes before = pipeline.save();
  Pipeline resumed = pipeline_of();
  EmptyMaps maps;
  ASSERT_TRUE(resumed.restore(before, maps.tiles));
  const StereoFrame first = frame_at(1), second = frame_at(2);
  for (const bool left : {true, false}) {
    for (const bool right : {true, false}) {
      if (!left && !right) continue;
      StereoFrame repeated = second;
      if (left) repeated.left = first.left;
      if (right) repeated.right = first.right;
      for (Pipeline* each : {&pipeline, &resumed}) {
        const auto refused = each->add(repeated);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::frame_rejected);
        const char* which = left && right ? "left and right image of" : left ? "left image of" : "right image of";
        EXPECT_TRUE(refused.error().message().find(which) != std::string::npos) << refused.error().message();
        EXPECT_EQ(each->fault_of(repeated), FrameFault::frozen);
        EXPECT_EQ(each->save(), before) << "nothing has advanced";
      }
    }
  }
  // Only the previous image counts: an earlier one may come again.
  EXPECT_NEAR(push(pipeline, 2).world_from_body.pose.translation().x(), 2 * kStep_m, 0.003);
  StereoFrame later = first;
  later.left_stamp = later.right_stamp = Stamp{3'000'000'000LL};
  const auto back = pipeline.add(later);
  ASSERT_TRUE(back);
  EXPECT_NEAR((*back)->world_from_body.pose.translation().x(), kStep_m, 0.003);
}

TEST(PipelineFaults, UniformImagesMayRepeat) {
  Pipeline pipeline = pipeline_of();
  const Image<std::uint8_t> dark(kStereo.size);
  for (int i = 0; i < 3; ++i) {
    StereoFrame frame = frame_at(i);
    frame.left = frame.right = FrameImage::borrow(dark.view(), {});
    EXPECT_TRUE(pipeline.add(frame)) << i;
  }
}

}  // namespace
}  // namespace spartan
