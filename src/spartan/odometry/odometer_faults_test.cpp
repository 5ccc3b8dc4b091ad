// Frames that are lost, in part missing, or show an object that moves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "spartan/numerics/random.h"
#include "spartan/odometry/internal/landmarks/odometer_memory.h"
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

// Nothing is found near the predictions, and the search of the whole image has no right one.
TEST(OdometerFaults, IsLostWhereTheRightImageOfAnotherSceneIsMissing) {
  const SyntheticWorld world(testing::SyntheticWorldOptions{});
  const SyntheticFrame elsewhere = world.render(kCameras, camera_at(30, 20, 0), 300);
  Odometer odometer = after_frames(4);
  RectifiedPair pair = pair_of(elsewhere, 4);
  pair.right = {};
  EXPECT_EQ(odometer.add(pair).status, TrackingStatus::lost);
  const MotionEstimate back = odometer.add(pair_of(5));
  EXPECT_EQ(back.status, TrackingStatus::tracking) << back.reason;
  EXPECT_LT(translation_error(back, 3, 5), 0.001);
}

// Poses relative to the frame at which a drive is disturbed, composed of the motions that begin at earlier frames.
class Chain {
 public:
  explicit Chain(int first) { poses_[pair_of(first).stamp.ns] = Pose(); }
  /// first_from_current.
  const Pose& add(const MotionEstimate& motion) {
    return poses_[motion.to.ns] = poses_.at(motion.from.ns) * motion.previous_from_current;
  }

 private:
  std::map<std::int64_t, Pose> poses_;
};

// Motion blur along the rows.
Image<std::uint8_t> blurred(ImageView<const std::uint8_t> image) {
  constexpr int kRadius = 12;
  Image<std::uint8_t> result(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      int sum = 0;
      for (int i = -kRadius; i <= kRadius; ++i) sum += image(std::clamp(x + i, 0, image.width() - 1), y);
      result(x, y) = static_cast<std::uint8_t>(sum / (2 * kRadius + 1));
    }
  }
  return result;
}

TEST(OdometerFaults, FindsSharpLandmarksAfterBlurredFrames) {
  Odometer odometer = after_frames(4);
  Chain chain(3);
  for (int i = 4; i < 8; ++i) {
    RectifiedPair pair = pair_of(i);
    const Image<std::uint8_t> left = blurred(pair.left), right = blurred(pair.right);
    pair.left = left;
    pair.right = right;
    chain.add(odometer.add(pair));
  }
  const MotionEstimate back = odometer.add(pair_of(8));
  EXPECT_EQ(back.status, TrackingStatus::tracking) << back.reason;
  // What was measured in the blurred frames does not matter.
  EXPECT_LT((true_motion(3, 8).inverse() * chain.add(back)).translation().norm(), 0.002);
  EXPECT_EQ(odometer.add(pair_of(9)).status, TrackingStatus::tracking);
}

// Landmarks of other cameras are not searched.
TEST(OdometerFaults, AChangeOfTheGeometryDiscardsTheKeptFrame) {
  Odometer odometer = after_frames(4);
  for (int i = 4; i < 6; ++i) {
    RectifiedPair pair = pair_of(i);
    const Image<std::uint8_t> left = blurred(pair.left), right = blurred(pair.right);
    pair.left = left;
    pair.right = right;
    odometer.add(pair);
  }
  const auto keeps_frame = [&] { return internal::OdometerMemory::restore(odometer.save()).value().kept.is_kept(); };
  EXPECT_TRUE(keeps_frame());
  RectifiedPair pair = pair_of(6);
  pair.geometry.focal_px *= 1.2;
  EXPECT_EQ(odometer.add(pair).status, TrackingStatus::lost);
  EXPECT_FALSE(keeps_frame());
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

// Pastes a textured board into both images, nearer than the ground, its left edge at `left_px`.
SyntheticFrame with_board(const SyntheticFrame& scene, int left_px, ImageSize size = {184, 130}, int top_px = 50) {
  SyntheticFrame frame{scene.left.clone(), scene.right.clone(), scene.disparity.clone(), scene.mask.clone()};
  constexpr int kDisparity = 45, kBlob_px = 5;
  Random random(11);
  Image<float> blobs(size.width / kBlob_px + 2, size.height / kBlob_px + 2);
  for (int y = 0; y < blobs.height(); ++y) {
    for (int x = 0; x < blobs.width(); ++x) blobs(x, y) = static_cast<float>(random.uniform(20, 235));
  }
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const int i = x / kBlob_px, j = y / kBlob_px;
      const float a = static_cast<float>(x % kBlob_px) / kBlob_px, b = static_cast<float>(y % kBlob_px) / kBlob_px;
      const float upper = (1 - a) * blobs(i, j) + a * blobs(i + 1, j);
      const float lower = (1 - a) * blobs(i, j + 1) + a * blobs(i + 1, j + 1);
      const auto gray = static_cast<std::uint8_t>((1 - b) * upper + b * lower);
      frame.left(left_px + x, top_px + y) = gray;
      frame.right(left_px + x - kDisparity, top_px + y) = gray;
    }
  }
  return frame;
}

// A board over 31 % of the view keeps its distance from the rover, so that it moves in the images as no part of the
// ground does.
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

// A board over 55 % of the view, and then nothing of the scene beside it: the motion is lost rather than that of the
// board taken for it.
TEST(OdometerFaults, DoesNotTrustAnObjectWithoutTheScene) {
  const SyntheticFrame& scene = frame_of(4);
  const SyntheticFrame dark{Image<std::uint8_t>(320, 240, 90), Image<std::uint8_t>(320, 240, 90),
                            scene.disparity.clone(), scene.mask.clone()};
  const auto board_on = [](const SyntheticFrame& behind, int i) {
    return with_board(behind, 60 + 4 * (i - 4), {220, 190}, 20);
  };
  Odometer odometer = after_frames(4);
  Chain chain(3);
  chain.add(odometer.add(pair_of(board_on(scene, 4), 4)));
  for (int i = 5; i < 7; ++i) {
    const MotionEstimate lost = odometer.add(pair_of(board_on(dark, i), i));
    EXPECT_EQ(lost.status, TrackingStatus::lost) << i;
    EXPECT_THAT(lost.reason, HasSubstr("are new, and their motion was not predicted"));
    EXPECT_LT((true_motion(3, i).inverse() * chain.add(lost)).translation().norm(), 0.01) << "by the prediction";
  }
  const MotionEstimate back = odometer.add(pair_of(7));
  EXPECT_EQ(back.status, TrackingStatus::tracking) << back.reason;
  EXPECT_LT((true_motion(3, 7).inverse() * chain.add(back)).translation().norm(), 0.002);
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
