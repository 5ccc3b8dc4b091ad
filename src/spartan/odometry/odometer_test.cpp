#include "spartan/odometry/odometer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <filesystem>

#include "spartan/image_io/image_io.h"
#include "spartan/numerics/random.h"
#include "spartan/odometry/internal/synthetic_drive_test.h"
#include "spartan/testing/real_data.h"
#include "spartan/testing/text_checks.h"

namespace spartan {

using namespace synthetic_drive;

namespace {

Image<std::uint8_t> noisy(const Image<std::uint8_t>& image, Random& random) {
  Image<std::uint8_t> result(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      result(x, y) = static_cast<std::uint8_t>(std::clamp(std::lround(image(x, y) + random.normal(0, 1.5)), 0L, 255L));
    }
  }
  return result;
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

// By the true disparities and the true motion.
TEST(Odometer, TracksAreTheLandmarksOfAMotion) {
  Odometer odometer = Odometer::create({}, ThreadPool(1)).value();
  odometer.add(pair_of(0));
  EXPECT_TRUE(odometer.tracks().empty());
  for (int i = 1; i < 4; ++i) {
    const MotionEstimate estimate = odometer.add(pair_of(i));
    std::vector<double> errors;
    for (const LandmarkTrack& track : odometer.tracks()) {
      const Eigen::Vector2d from = track.previous_px.cast<double>();
      const float d =
          frame_of(i - 1).disparity(static_cast<int>(std::lround(from.x())), static_cast<int>(std::lround(from.y())));
      if (!track.is_inlier || std::isnan(d)) continue;
      const Eigen::Vector3d point = kCameras.triangulate(from.x(), from.y(), static_cast<double>(d));
      const Eigen::Vector3d seen = kCameras.project(true_motion(i - 1, i).inverse() * point);
      errors.push_back((seen.head<2>() - track.current_px.cast<double>()).norm());
    }
    const auto inliers = std::count_if(odometer.tracks().begin(), odometer.tracks().end(),
                                       [](const LandmarkTrack& t) { return t.is_inlier; });
    EXPECT_EQ(inliers, estimate.inliers);
    ASSERT_GT(errors.size(), 100U);
    std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
    EXPECT_LT(errors[errors.size() / 2], 0.3);
  }
  const Image<std::uint8_t> blank(320, 240, 128);
  odometer.add(blank_pair(blank, 4));
  EXPECT_TRUE(odometer.tracks().empty());
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

// Of 9 frames whose camera moves ahead by `step_m` each.
struct Creep {
  int stationary = 0;
  double travelled_m = 0;
};
Creep creep(double step_m) {
  const SyntheticWorld world(testing::SyntheticWorldOptions{});
  Odometer odometer = Odometer::create({}, ThreadPool(1)).value();
  Creep result;
  Pose travelled;
  for (int i = 0; i < 9; ++i) {
    const SyntheticFrame frame =
        world.render(kCameras, camera_at(step_m * i, 0, 0), static_cast<std::uint64_t>(200 + i));
    const MotionEstimate e = odometer.add(pair_of(frame, i));
    result.stationary += e.status == TrackingStatus::stationary;
    travelled = travelled * e.previous_from_current;
  }
  result.travelled_m = travelled.translation().norm();
  return result;
}

TEST(Odometer, SlowMotionIsNotTakenForStationary) {
  // 0.3 mm a frame are 0.05 px: far below the limit of the flow, but several standard deviations of the motion.
  const Creep slow = creep(0.0003);
  EXPECT_EQ(slow.stationary, 0);
  EXPECT_NEAR(slow.travelled_m, 0.0024, 0.0002);
  // Within the noise it is stationary, but it accumulates until it is more.
  const Creep slower = creep(0.00001);
  EXPECT_GE(slower.stationary, 3);
  EXPECT_NEAR(slower.travelled_m, 0.00008, 0.00004);
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
