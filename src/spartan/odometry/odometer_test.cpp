#include "spartan/odometry/odometer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <filesystem>

#include "spartan/image_io/image_io.h"
#include "spartan/numerics/random.h"
#include "spartan/testing/real_data.h"
#include "spartan/testing/synthetic_world.h"
#include "spartan/testing/text_checks.h"

namespace spartan {
namespace {

using testing::SyntheticFrame;
using testing::SyntheticWorld;

const RectifiedStereo kCameras{{320, 240}, 246.0, {159.5, 119.5}, 0.12};

// A camera half a metre above level ground, tilted 32° down, heading `heading_rad` to the left of world x.
Pose camera_at(double x, double y, double heading_rad) {
  const double s = std::sin(0.55), c = std::cos(0.55);
  Eigen::Matrix3d body_from_optical;
  body_from_optical << 0, -s, c, -1, 0, 0, 0, -c, -s;
  return Pose(exp_so3({0, 0, heading_rad}), {x, y, 0.5}) * Pose(body_from_optical, {0, 0, 0});
}

// A curved drive: 4 cm and 0.8° per frame.
Pose true_pose(int frame) {
  const double heading = 0.014 * frame, radius = 0.04 / 0.014;
  return camera_at(radius * std::sin(heading), radius * (1 - std::cos(heading)), heading);
}

// Frames are rendered once for all tests.
const SyntheticFrame& frame_of(int index) {
  static const std::vector<SyntheticFrame> frames = [] {
    const SyntheticWorld world(testing::SyntheticWorldOptions{});
    std::vector<SyntheticFrame> rendered;
    rendered.reserve(10);
    for (int i = 0; i < 10; ++i)
      rendered.push_back(world.render(kCameras, true_pose(i), static_cast<std::uint64_t>(i)));
    return rendered;
  }();
  return frames[static_cast<std::size_t>(index)];
}

RectifiedPair pair_of(const SyntheticFrame& frame, int time) {
  RectifiedPair pair;
  pair.stamp.ns = time * 1'000'000'000LL;
  pair.geometry = kCameras;
  pair.left = frame.left;
  pair.right = frame.right;
  return pair;
}

RectifiedPair pair_of(int index) {
  return pair_of(frame_of(index), index);
}

RectifiedPair blank_pair(const Image<std::uint8_t>& blank, int time) {
  RectifiedPair pair = pair_of(0);
  pair.stamp.ns = time * 1'000'000'000LL;
  pair.left = blank;
  pair.right = blank;
  return pair;
}

Image<std::uint8_t> noisy(const Image<std::uint8_t>& image, Random& random) {
  Image<std::uint8_t> result(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      result(x, y) = static_cast<std::uint8_t>(std::clamp(std::lround(image(x, y) + random.normal(0, 1.5)), 0L, 255L));
    }
  }
  return result;
}

Pose true_motion(int from, int to) {
  return true_pose(from).inverse() * true_pose(to);
}

double translation_error(const MotionEstimate& estimate, int from, int to) {
  return (true_motion(from, to).inverse() * estimate.previous_from_current).translation().norm();
}

double rotation_error(const MotionEstimate& estimate, int from, int to) {
  return rotation_angle(true_motion(from, to).inverse() * estimate.previous_from_current);
}

std::vector<MotionEstimate> drive(const OdometryOptions& options, int threads = 1) {
  Odometer odometer = Odometer::create(options, ThreadPool(threads)).value();
  std::vector<MotionEstimate> estimates;
  estimates.reserve(10);
  for (int i = 0; i < 10; ++i) estimates.push_back(odometer.add(pair_of(i), {}, frame_of(i).disparity));
  return estimates;
}

bool same_bits(const MotionEstimate& a, const MotionEstimate& b) {
  return a.previous_from_current.matrix() == b.previous_from_current.matrix() && a.covariance == b.covariance &&
         a.status == b.status && a.inliers == b.inliers && a.rms_px == b.rms_px;
}

TEST(Odometer, FollowsASyntheticDrive) {
  const std::vector<MotionEstimate> estimates = drive({});
  EXPECT_TRUE(estimates[0].first);
  EXPECT_EQ(estimates[0].previous_from_current.matrix(), Eigen::Matrix4d::Identity());
  Pose travelled;
  double nees = 0;
  for (int i = 1; i < 10; ++i) {
    const MotionEstimate& e = estimates[static_cast<std::size_t>(i)];
    EXPECT_EQ(e.status, TrackingStatus::tracking) << e.reason;
    EXPECT_TRUE(e.reason.empty());
    EXPECT_GT(e.inliers, 100);
    EXPECT_LT(translation_error(e, i - 1, i), 0.0010) << i;
    EXPECT_LT(rotation_error(e, i - 1, i), 0.0010) << i;
    travelled = travelled * e.previous_from_current;
    const Vector6d error = log_se3(true_motion(i - 1, i).inverse() * e.previous_from_current);
    nees += error.dot(e.covariance.ldlt().solve(error)) / 9;
  }
  // A third of a percent of 36 cm.
  EXPECT_LT((true_motion(0, 9).inverse() * travelled).translation().norm(), 0.0012);
  EXPECT_GT(nees, 1);
  EXPECT_LT(nees, 15);  // expected value 6; nine correlated samples
}

TEST(Odometer, EverySubModuleCanBeSwitchedOff) {
  for (const char* switched :
       {"detection.surf.upright=false", "reconstruction.source=dense", "reconstruction.left_right_check=false",
        "reconstruction.slant=false", "matching.descriptors=false", "matching.correlation=false",
        "matching.rigidity=false", "motion.robust=false", "motion.offset_sigma_px=0", "stationary.detect=false"}) {
    const Result<OdometryOptions> options = set_option(OdometryOptions{}, switched);
    ASSERT_TRUE(options.has_value()) << options.error().message();
    Pose travelled;
    const bool coarse = std::string(switched) == "matching.correlation=false";
    for (const MotionEstimate& e : drive(*options)) {
      EXPECT_NE(e.status, TrackingStatus::lost) << switched << ": " << e.reason;
      travelled = travelled * e.previous_from_current;
    }
    EXPECT_LT((true_motion(0, 9).inverse() * travelled).translation().norm(), coarse ? 0.02 : 0.004) << switched;
  }
}

TEST(Odometer, IsBitIdenticalForAnyNumberOfThreads) {
  const std::vector<MotionEstimate> one = drive({}, 1), two = drive({}, 2);
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_TRUE(same_bits(one[i], two[i])) << i;
}

TEST(Odometer, ResumesFromItsSavedStateBitForBit) {
  Odometer whole = Odometer::create({}, ThreadPool(1)).value();
  for (int i = 0; i < 5; ++i) whole.add(pair_of(i));
  Odometer resumed = Odometer::create({}, ThreadPool(1)).value();
  ASSERT_TRUE(resumed.restore(whole.save()).has_value());
  for (int i = 5; i < 10; ++i) {
    EXPECT_TRUE(same_bits(whole.add(pair_of(i)), resumed.add(pair_of(i)))) << i;
    EXPECT_EQ(whole.save(), resumed.save());
  }
  const Bytes before = resumed.save();
  EXPECT_FALSE(resumed.restore(Bytes{1, 2, 3}).has_value());
  EXPECT_EQ(resumed.save(), before);
}

TEST(Odometer, IsStationaryOnImagesThatDifferInNoiseOnly) {
  for (const bool detect : {true, false}) {
    Random random(1);
    OdometryOptions options;
    options.stationary.detect = detect;
    Odometer odometer = Odometer::create(options, ThreadPool(1)).value();
    Pose travelled;
    for (int i = 0; i < 8; ++i) {
      const Image<std::uint8_t> left = noisy(frame_of(0).left, random), right = noisy(frame_of(0).right, random);
      RectifiedPair pair = pair_of(frame_of(0), i);
      pair.left = left;
      pair.right = right;
      const MotionEstimate e = odometer.add(pair);
      travelled = travelled * e.previous_from_current;
      if (i > 0) {
        EXPECT_EQ(e.status, detect ? TrackingStatus::stationary : TrackingStatus::tracking);
      }
    }
    EXPECT_LT(travelled.translation().norm(), detect ? 1e-12 : 0.0005);
    // The next frame has moved: the whole motion is measured.
    const MotionEstimate moved = odometer.add(pair_of(frame_of(1), 8));
    EXPECT_EQ(moved.status, TrackingStatus::tracking);
    EXPECT_LT(translation_error(moved, 0, 1), 0.001);
  }
}

TEST(Odometer, SlowMotionIsNotTakenForStationary) {
  // 0.3 mm per frame is 0.05 px: stationary at first, but it accumulates until it exceeds a quarter of a pixel (1.6
  // mm).
  const SyntheticWorld world(testing::SyntheticWorldOptions{});
  Odometer odometer = Odometer::create({}, ThreadPool(1)).value();
  Pose travelled;
  int stationary = 0;
  for (int i = 0; i < 9; ++i) {
    const SyntheticFrame frame =
        world.render(kCameras, camera_at(0.0003 * i, 0, 0), static_cast<std::uint64_t>(200 + i));
    const MotionEstimate e = odometer.add(pair_of(frame, i));
    stationary += e.status == TrackingStatus::stationary;
    travelled = travelled * e.previous_from_current;
  }
  EXPECT_GE(stationary, 3);
  EXPECT_GT(travelled.translation().norm(), 0.0014);
  EXPECT_LT(travelled.translation().norm(), 0.0026);
}

TEST(Odometer, ABadFrameCostsNothing) {
  Odometer odometer = Odometer::create({}, ThreadPool(1)).value();
  for (int i = 0; i < 4; ++i) odometer.add(pair_of(i));
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

TEST(Odometer, MeasuresInTheLeftImageWhileTheRightOneIsDarkOrMissing) {
  const Image<std::uint8_t> dark(320, 240, 2);
  for (const ImageView<const std::uint8_t> right : {ImageView<const std::uint8_t>(dark), {}}) {
    Odometer odometer = Odometer::create({}, ThreadPool(1)).value();
    for (int i = 0; i < 4; ++i) odometer.add(pair_of(i));
    for (int i = 4; i < 7; ++i) {
      RectifiedPair pair = pair_of(i);
      pair.right = right;
      const MotionEstimate estimate = odometer.add(pair);
      EXPECT_EQ(estimate.status, TrackingStatus::degraded);
      EXPECT_THAT(estimate.reason, ::testing::HasSubstr("seen by both cameras"));
      EXPECT_EQ(estimate.from, pair_of(i - 1).stamp);
      EXPECT_LT(translation_error(estimate, i - 1, i), 0.0015) << i;
    }
    const MotionEstimate back = odometer.add(pair_of(7));
    EXPECT_EQ(back.status, TrackingStatus::tracking) << back.reason;
    EXPECT_LT(translation_error(back, 6, 7), 0.001);
  }
}

TEST(Odometer, MeasuresInTheRightImageWhileTheLeftOneIsDarkOrMissing) {
  const Image<std::uint8_t> dark(320, 240, 2);
  for (const ImageView<const std::uint8_t> left : {ImageView<const std::uint8_t>(dark), {}}) {
    Odometer odometer = Odometer::create({}, ThreadPool(1)).value();
    for (int i = 0; i < 4; ++i) odometer.add(pair_of(i));
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
TEST(Odometer, SearchesLandmarksByTheMotionOfOtherSensors) {
  const SyntheticWorld world(testing::SyntheticWorldOptions{});
  const Pose turned = true_pose(3) * true_pose(0).inverse() * camera_at(0.3, 0, 0.7);
  const SyntheticFrame frame = world.render(kCameras, turned, 500);
  const Pose truth = true_pose(3).inverse() * turned;
  const Pose measured = truth * exp_se3((Vector6d() << 0.01, -0.01, 0.01, 0.005, -0.005, 0.01).finished());
  for (const bool known : {false, true}) {
    Odometer odometer = Odometer::create({}, ThreadPool(1)).value();
    for (int i = 0; i < 4; ++i) odometer.add(pair_of(i));
    const MotionEstimate estimate =
        odometer.add(pair_of(frame, 4), {}, {}, known ? std::optional(measured) : std::nullopt);
    EXPECT_EQ(estimate.status == TrackingStatus::lost, !known) << estimate.reason;
    if (!known) continue;
    EXPECT_LT((truth.inverse() * estimate.previous_from_current).translation().norm(), 0.004);
  }
}

TEST(Odometer, IsLostWithoutImages) {
  Odometer odometer = Odometer::create({}, ThreadPool(1)).value();
  for (int i = 0; i < 4; ++i) odometer.add(pair_of(i));
  RectifiedPair pair = pair_of(4);
  pair.left = pair.right = {};
  const MotionEstimate lost = odometer.add(pair);
  EXPECT_EQ(lost.status, TrackingStatus::lost);
  EXPECT_THAT(lost.reason, ::testing::HasSubstr("both images are missing"));
  EXPECT_EQ(odometer.add(pair_of(5)).status, TrackingStatus::tracking);
}

// The landmarks of the reference are out of view after some frames of another scene: those of the last frame are used.
TEST(Odometer, GoesOnFromALostFrameWhereTheOldLandmarksAreGone) {
  Odometer odometer = Odometer::create({}, ThreadPool(1)).value();
  for (int i = 0; i < 4; ++i) odometer.add(pair_of(i));
  const SyntheticWorld world(testing::SyntheticWorldOptions{});
  const SyntheticFrame elsewhere = world.render(kCameras, camera_at(30, 20, 0), 300),
                       beside = world.render(kCameras, camera_at(30.05, 20, 0), 301);
  EXPECT_EQ(odometer.add(pair_of(elsewhere, 4)).status, TrackingStatus::lost);
  const MotionEstimate back = odometer.add(pair_of(beside, 5));
  EXPECT_EQ(back.status, TrackingStatus::tracking) << back.reason;
  EXPECT_EQ(back.from, pair_of(4).stamp);
  EXPECT_NEAR(back.previous_from_current.translation().norm(), 0.05, 0.002);
}

TEST(Odometer, UsesAGivenPrediction) {
  // A motion of five frames at once, without descriptors: found only with the prediction.
  OdometryOptions options;
  options.matching.descriptors = false;
  Odometer predicted = Odometer::create(options, ThreadPool(1)).value();
  Odometer unpredicted = Odometer::create(options, ThreadPool(1)).value();
  predicted.add(pair_of(0));
  unpredicted.add(pair_of(0));
  const MotionEstimate found = predicted.add(pair_of(5), true_motion(0, 5));
  EXPECT_EQ(found.status, TrackingStatus::tracking) << found.reason;
  EXPECT_LT(translation_error(found, 0, 5), 0.004);
  EXPECT_NE(unpredicted.add(pair_of(5)).status, TrackingStatus::tracking);
}

TEST(Odometer, FindsALargeUnpredictedMotion) {
  Odometer odometer = Odometer::create({}, ThreadPool(1)).value();
  odometer.add(pair_of(0));
  const MotionEstimate found = odometer.add(pair_of(6));
  EXPECT_EQ(found.status, TrackingStatus::tracking) << found.reason;
  EXPECT_LT(translation_error(found, 0, 6), 0.004);
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
TEST(Odometer, DoesNotFollowAMovingObject) {
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
TEST(Odometer, FollowsMostOfTheViewWhereFewMatchesArePredicted) {
  Odometer odometer = Odometer::create({}, ThreadPool(1)).value();
  for (int i = 0; i < 4; ++i) odometer.add(pair_of(i));
  const SyntheticFrame jumped = with_tiles_of(frame_of(7), frame_of(4));
  const MotionEstimate estimate = odometer.add(pair_of(jumped, 4));
  EXPECT_NE(estimate.status, TrackingStatus::lost) << estimate.reason;
  EXPECT_LT(translation_error(estimate, 3, 7), 0.004) << estimate.reason;
}

TEST(Odometer, RejectsUnusablePairsWithoutCrashing) {
  for (const auto& [width, height] : {std::pair(1, 1), {3, 200}, {12, 12}, {30, 20}, {64, 48}}) {
    Odometer odometer = Odometer::create({}, ThreadPool(2)).value();
    const Image<std::uint8_t> tiny(width, height, 60);
    RectifiedPair pair = blank_pair(tiny, 0);
    pair.geometry.size = tiny.size();
    EXPECT_TRUE(odometer.add(pair).first);
    pair.stamp.ns = 1;
    EXPECT_EQ(odometer.add(pair).status, TrackingStatus::lost);
  }
  Odometer odometer = Odometer::create({}, ThreadPool(1)).value();
  EXPECT_EQ(odometer.add(RectifiedPair{}).status, TrackingStatus::lost);
  odometer.add(pair_of(0));
  RectifiedPair uneven = pair_of(1);
  uneven.right = uneven.right.crop(0, 0, 300, 240);
  EXPECT_EQ(odometer.add(uneven).reason, "left and right image differ in size");
  RectifiedPair other = pair_of(1);
  other.geometry.focal_px = 300;
  EXPECT_EQ(odometer.add(other).status, TrackingStatus::lost);
}

TEST(Odometer, MeasuresTheFirstMetersOfKitti) {
  const std::string folder = testing::data_folder() + "/kitti_06";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "set SPARTAN_DATA to the folder with kitti_06";
  Odometer odometer = Odometer::create({}, ThreadPool(2)).value();
  Pose travelled;
  for (int i = 0; i < 6; ++i) {
    const auto left = read_gray8(folder + "/image_0/00000" + std::to_string(i) + ".png"),
               right = read_gray8(folder + "/image_1/00000" + std::to_string(i) + ".png");
    ASSERT_TRUE(left && right);
    RectifiedPair pair;
    pair.stamp = Stamp::from_seconds(0.1 * i);
    pair.geometry = {left->size(), 707.0912, {601.8873, 183.1104}, 379.8145 / 707.0912};
    pair.left = *left;
    pair.right = *right;
    const MotionEstimate e = odometer.add(pair);
    EXPECT_EQ(e.status, TrackingStatus::tracking) << e.reason;
    travelled = travelled * e.previous_from_current;
  }
  // poses.txt, line 6.
  EXPECT_LT((travelled.translation() - Eigen::Vector3d(-0.0697, -0.1402, 5.9623)).norm(), 0.1);
}

TEST(Odometer, RefusesOptionsOutOfBounds) {
  OdometryOptions options;
  options.detection.surf.octaves = 0;
  const auto created = Odometer::create(options, ThreadPool(1));
  EXPECT_THAT(testing::error_message(created),
              ::testing::HasSubstr("odometry options: detection.surf.octaves is 0, must be between 1 and 5"));
}

}  // namespace
}  // namespace spartan
