// Frames that are lost, in part missing, or show an object that moves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "spartan/numerics/random.h"
#include "spartan/odometry/internal/synthetic_drive_test.h"
#include "spartan/odometry/odometer.h"

namespace spartan {

using namespace synthetic_drive;

namespace {

using ::testing::HasSubstr;

TEST(OdometerFaults, ABadFrameCostsNothing) {
  Odometer odometer = after_frames(4);
  const Image<std::uint8_t> blank(320, 240, 90);
  const MotionEstimate lost = odometer.add(blank_pair(blank, 4));
  EXPECT_EQ(lost.status, TrackingStatus::lost);
  EXPECT_FALSE(lost.reason.empty());
  EXPECT_TRUE(lost.keeps_reference);
  // The constant-velocity prediction with a large covariance.
  EXPECT_LT(translation_error(lost, 3, 4), 0.002);
  EXPECT_GT(lost.covariance(0, 0), 0.1);
  const MotionEstimate back = odometer.add(pair_of(5));
  EXPECT_EQ(back.status, TrackingStatus::tracking) << back.reason;
  EXPECT_EQ(back.from, pair_of(3).stamp);
  EXPECT_FALSE(back.keeps_reference);
  EXPECT_LT(translation_error(back, 3, 5), 0.001);
  EXPECT_LT(translation_error(odometer.add(pair_of(6)), 5, 6), 0.001);
}

TEST(OdometerFaults, MeasuresInTheLeftImageWhileTheRightOneIsDarkOrMissing) {
  const Image<std::uint8_t> dark(320, 240, 2);
  for (const ImageView<const std::uint8_t> right : {ImageView<const std::uint8_t>(dark), {}}) {
    Odometer odometer = after_frames(4);
    for (int i = 4; i < 7; ++i) {
      RectifiedPair pair = pair_of(i);
      pair.right = right;
      const MotionEstimate estimate = odometer.add(pair);
      EXPECT_EQ(estimate.status, TrackingStatus::degraded);
      EXPECT_THAT(estimate.reason, HasSubstr("seen by both cameras"));
      EXPECT_EQ(estimate.from, pair_of(i - 1).stamp);
      EXPECT_LT(translation_error(estimate, i - 1, i), 0.0015) << i;
    }
    const MotionEstimate back = odometer.add(pair_of(7));
    EXPECT_EQ(back.status, TrackingStatus::tracking) << back.reason;
    EXPECT_LT(translation_error(back, 6, 7), 0.001);
  }
}

TEST(OdometerFaults, MeasuresInTheRightImageWhileTheLeftOneIsDarkOrMissing) {
  const Image<std::uint8_t> dark(320, 240, 2);
  for (const ImageView<const std::uint8_t> left : {ImageView<const std::uint8_t>(dark), {}}) {
    Odometer odometer = after_frames(4);
    for (int i = 4; i < 7; ++i) {
      RectifiedPair pair = pair_of(i);
      pair.left = left;
      const MotionEstimate estimate = odometer.add(pair);
      EXPECT_EQ(estimate.status, TrackingStatus::degraded) << estimate.reason;
      EXPECT_TRUE(estimate.keeps_reference);
      EXPECT_EQ(estimate.from, pair_of(3).stamp);
      EXPECT_LT(translation_error(estimate, 3, i), 0.002) << i;
    }
    const MotionEstimate back = odometer.add(pair_of(7));
    EXPECT_EQ(back.status, TrackingStatus::tracking) << back.reason;
    EXPECT_EQ(back.from, pair_of(3).stamp);
    EXPECT_LT(translation_error(back, 3, 7), 0.002);
  }
}

// A turn of 40° on the spot between two frames, of which no other sensor or the IMU knows.
TEST(OdometerFaults, SearchesLandmarksByTheMotionOfOtherSensors) {
  const SyntheticWorld world(testing::SyntheticWorldOptions{});
  const Pose turned = true_pose(3) * true_pose(0).inverse() * camera_at(0.3, 0, 0.7);
  const SyntheticFrame frame = world.render(kCameras, turned, 500);
  const Pose truth = true_pose(3).inverse() * turned;
  const Pose measured = truth * exp_se3((Vector6d() << 0.01, -0.01, 0.01, 0.005, -0.005, 0.01).finished());
  for (const bool known : {false, true}) {
    Odometer odometer = after_frames(4);
    const MotionEstimate estimate =
        odometer.add(pair_of(frame, 4), {}, {}, known ? std::optional(measured) : std::nullopt);
    EXPECT_EQ(estimate.status == TrackingStatus::lost, !known) << estimate.reason;
    if (!known) continue;
    EXPECT_LT((truth.inverse() * estimate.previous_from_current).translation().norm(), 0.004);
  }
}

TEST(OdometerFaults, IsLostWithoutImages) {
  Odometer odometer = after_frames(4);
  RectifiedPair pair = pair_of(4);
  pair.left = pair.right = {};
  const MotionEstimate lost = odometer.add(pair);
  EXPECT_EQ(lost.status, TrackingStatus::lost);
  EXPECT_THAT(lost.reason, HasSubstr("both images are missing"));
  EXPECT_EQ(odometer.add(pair_of(5)).status, TrackingStatus::tracking);
}

// The landmarks of the reference are out of view after some frames of another scene: those of the last frame are used.
TEST(OdometerFaults, GoesOnFromALostFrameWhereTheOldLandmarksAreGone) {
  Odometer odometer = after_frames(4);
  const SyntheticWorld world(testing::SyntheticWorldOptions{});
  const SyntheticFrame elsewhere = world.render(kCameras, camera_at(30, 20, 0), 300),
                       beside = world.render(kCameras, camera_at(30.05, 20, 0), 301);
  EXPECT_EQ(odometer.add(pair_of(elsewhere, 4)).status, TrackingStatus::lost);
  const MotionEstimate back = odometer.add(pair_of(beside, 5));
  EXPECT_EQ(back.status, TrackingStatus::tracking) << back.reason;
  EXPECT_EQ(back.from, pair_of(4).stamp);
  EXPECT_NEAR(back.previous_from_current.translation().norm(), 0.05, 0.002);
}

// Pastes a textured board into both images: 31 % of the view, nearer than the ground, its left edge at `left_px`.
SyntheticFrame with_board(const SyntheticFrame& scene, int left_px) {
  SyntheticFrame frame{scene.left.clone(), scene.right.clone(), scene.disparity.clone(), scene.mask.clone()};
  constexpr int kWidth = 184, kHeight = 130, kTop = 50, kDisparity = 45, kBlob_px = 5;
  Random random(11);
  Image<float> blobs(kWidth / kBlob_px + 2, kHeight / kBlob_px + 2);
  for (int y = 0; y < blobs.height(); ++y) {
    for (int x = 0; x < blobs.width(); ++x) blobs(x, y) = static_cast<float>(random.uniform(20, 235));
  }
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const int i = x / kBlob_px, j = y / kBlob_px;
      const float a = static_cast<float>(x % kBlob_px) / kBlob_px, b = static_cast<float>(y % kBlob_px) / kBlob_px;
      const float upper = (1 - a) * blobs(i, j) + a * blobs(i + 1, j);
      const float lower = (1 - a) * blobs(i, j + 1) + a * blobs(i + 1, j + 1);
      const auto gray = static_cast<std::uint8_t>((1 - b) * upper + b * lower);
      frame.left(left_px + x, kTop + y) = gray;
      frame.right(left_px + x - kDisparity, kTop + y) = gray;
    }
  }
  return frame;
}

// A board keeps its distance from the rover, so that it moves in the images as no part of the ground does.
TEST(OdometerFaults, DoesNotFollowAMovingObject) {
  constexpr int kFirst = 3;
  Odometer odometer = Odometer::create({}, ThreadPool(1)).value();
  int warned = 0;
  Pose start_from_current;
  for (int i = 0; i < 10; ++i) {
    const SyntheticFrame disturbed = with_board(frame_of(i), 70 + 3 * (i - kFirst));
    const MotionEstimate estimate = odometer.add(pair_of(i < kFirst ? frame_of(i) : disturbed, i));
    start_from_current = start_from_current * estimate.previous_from_current;
    warned += estimate.status == TrackingStatus::degraded && i > 0;
  }
  const Pose error = true_motion(0, 9).inverse() * start_from_current;
  EXPECT_LT(error.translation().norm(), 0.02) << "of 36 cm";
  EXPECT_LT(rotation_angle(error), 0.02);
  EXPECT_GE(warned, 4) << "of the 6 motions of the board";
}

// Tiles of another frame, spread over the view: 15 % of it.
SyntheticFrame with_tiles_of(const SyntheticFrame& scene, const SyntheticFrame& other) {
  SyntheticFrame frame{scene.left.clone(), scene.right.clone(), scene.disparity.clone(), scene.mask.clone()};
  constexpr int kTile = 44, kPitch = 85, kMargin = 3;
  for (int top = 20; top + kTile < frame.left.height(); top += kPitch) {
    for (int left = 75; left + kTile + kMargin < frame.left.width(); left += kPitch) {
      const int disparity = static_cast<int>(std::lround(other.disparity(left + kTile / 2, top + kTile / 2)));
      for (int y = top; y < top + kTile; ++y) {
        std::copy_n(other.left.row(y) + left, kTile, frame.left.row(y) + left);
        const int from = left - disparity - kMargin;
        std::copy_n(other.right.row(y) + from, kTile + 2 * kMargin, frame.right.row(y) + from);
      }
    }
  }
  return frame;
}

// Few matches agree with the prediction, most with another motion: the rover has moved otherwise than before.
TEST(OdometerFaults, FollowsMostOfTheViewWhereFewMatchesArePredicted) {
  Odometer odometer = after_frames(4);
  const SyntheticFrame jumped = with_tiles_of(frame_of(7), frame_of(4));
  const MotionEstimate estimate = odometer.add(pair_of(jumped, 4));
  EXPECT_NE(estimate.status, TrackingStatus::lost) << estimate.reason;
  EXPECT_LT(translation_error(estimate, 3, 7), 0.004) << estimate.reason;
}

}  // namespace
}  // namespace spartan
