#include "spartan/odometry/internal/landmark_manager.h"

#include <gtest/gtest.h>

#include <cmath>

#include "spartan/numerics/random.h"
#include "spartan/odometry/internal/matching/smoothed_image.h"

namespace spartan::internal {
namespace {

const RectifiedStereo kSmallStereo{{200, 150}, 150, {99.5, 74.5}, 0.1};

class LandmarkManagerTest : public ::testing::Test {
 protected:
  LandmarkManagerTest() : image_(200, 150) {
    Random random(1);
    for (int y = 0; y < 150; ++y)
      for (int x = 0; x < 200; ++x) image_(x, y) = static_cast<std::uint8_t>(random.below(256));
    smooth_.compute(image_, ThreadPool(1));
    memory_.anchors.push_back({0, Pose()});
    memory_.next_anchor_id = 1;
    Landmark landmark;
    landmark.anchor_pixel = landmark.pixel = {120, 80};
    landmark.disparity = 10;
    landmark.variance = 0.04;
    memory_.landmarks.push_back(landmark);
  }

  StereoImages images() const { return {kSmallStereo, image_, image_, smooth_.view(), smooth_.view(), {}, {}, {}}; }

  // The rover moves and measures the landmark, whose true disparity in the anchor is `truth`, without noise.
  void measure(const Pose& previous_from_current, double truth, bool inlier = true, double offset = 0,
               bool moved = true) {
    LandmarkMatch match;
    match.point = {memory_.landmarks[0].anchor_pixel, memory_.landmarks[0].disparity};
    match.disparity_variance = memory_.landmarks[0].variance;
    match.previous_from_anchor = memory_.anchors[0].latest_from_anchor;
    const Pose current_from_anchor = previous_from_current.inverse() * match.previous_from_anchor;
    match.measured = project_anchored(kSmallStereo, {match.point.pixel, truth}, current_from_anchor)->measured;
    match.measured.z() -= offset;
    match.covariance = 0.01 * Eigen::Matrix3d::Identity();
    MotionFit fit;
    fit.previous_from_current = previous_from_current;
    fit.inlier = {inlier};
    fit.offset.value = offset;
    move_anchors(memory_, previous_from_current);
    manager_.update(memory_, images(), {match}, fit, moved, {}, {});
  }

  ReconstructedFeature feature_at(float x, float y) const {
    ReconstructedFeature f;
    f.feature.x = x;
    f.feature.y = y;
    f.stereo = RowAlignment{12, {0, 0}, 0.05, 1};
    return f;
  }

  Image<std::uint8_t> image_;
  SmoothedImage smooth_;
  LandmarkMemory memory_;
  LandmarkManager manager_{OdometryOptions{}};
};

TEST_F(LandmarkManagerTest, FusesTheMeasuredDisparityByVariance) {
  measure(Pose(), 10.5);  // stationary: only the disparity is informative, σ² 0.01 against 0.04
  EXPECT_NEAR(memory_.landmarks[0].disparity, 10 + 0.5 * 0.04 / 0.05, 1e-9);
  EXPECT_NEAR(memory_.landmarks[0].variance, 0.04 * 0.01 / 0.05, 1e-9);
}

TEST_F(LandmarkManagerTest, FusesMotionParallax) {
  measure(Pose::from_translation({0.5, 0, 0}), 10.5);  // five baselines to the side
  EXPECT_NEAR(memory_.landmarks[0].disparity, 10.5, 0.01);
  EXPECT_LE(memory_.landmarks[0].variance, 0.0011);
}

TEST_F(LandmarkManagerTest, TheDisparityOffsetDoesNotEnterTheDisparity) {
  measure(Pose(), 10.2, true, 0.2);  // the error of a disparity that was measured before the offset was known
  EXPECT_NEAR(memory_.landmarks[0].disparity, 10, 1e-9);
}

TEST_F(LandmarkManagerTest, ReanchorsALandmarkWhoseScaleHasChanged) {
  const Pose ahead = Pose::from_translation({0, 0, 0.5});  // from 1.5 m to 1 m
  measure(ahead, 10);
  const Landmark& l = memory_.landmarks[0];
  EXPECT_EQ(l.anchor_id, 1u);
  const Eigen::Vector3d expected = project_anchored(kSmallStereo, {{120, 80}, 10}, ahead.inverse())->measured;
  EXPECT_EQ(l.anchor_pixel.x(), std::round(expected.x()));
  EXPECT_EQ(l.anchor_pixel.y(), std::round(expected.y()));
  EXPECT_NEAR(l.disparity, expected.z(), 1e-6);
  EXPECT_EQ(l.patch,
            *cut_patch(smooth_.view(), static_cast<int>(l.anchor_pixel.x()), static_cast<int>(l.anchor_pixel.y())));
}

TEST_F(LandmarkManagerTest, RemovesLandmarksThatAreMissedTwice) {
  measure(Pose(), 10, false);
  ASSERT_EQ(memory_.landmarks.size(), 1u);
  measure(Pose(), 10, true);
  EXPECT_EQ(memory_.landmarks[0].missed_frames, 0);
  measure(Pose(), 10, false);
  measure(Pose(), 10, false);
  EXPECT_TRUE(memory_.landmarks.empty());
}

TEST_F(LandmarkManagerTest, LandmarksAreEstablishedByFollowingTheScene) {
  EXPECT_FALSE(is_established(memory_.landmarks[0]));
  measure(Pose(), 10, false);
  EXPECT_FALSE(is_established(memory_.landmarks[0])) << "an outlier";
  measure(Pose(), 10, true, 0, false);
  EXPECT_FALSE(is_established(memory_.landmarks[0])) << "the rover has not moved";
  measure(Pose::from_translation({0.01, 0, 0}), 10);
  EXPECT_TRUE(is_established(memory_.landmarks[0]));
}

TEST_F(LandmarkManagerTest, AddsFeaturesThatAreFarFromLandmarksAndHaveADisparity) {
  std::vector<ReconstructedFeature> features{feature_at(40.4f, 30.6f), feature_at(122, 81), feature_at(42, 31),
                                             feature_at(60, 60), feature_at(3, 3)};
  features[3].stereo.reset();
  manager_.add(memory_, images(), features);
  ASSERT_EQ(memory_.landmarks.size(), 2u);
  EXPECT_EQ(memory_.landmarks[1].anchor_pixel, Eigen::Vector2d(40, 31));
  EXPECT_EQ(memory_.landmarks[1].disparity, 12);
  EXPECT_EQ(memory_.anchors.size(), 2u);
  manager_.add(memory_, images(), {});
  EXPECT_EQ(memory_.anchors.size(), 2u);  // an anchor without landmarks is removed
}

}  // namespace
}  // namespace spartan::internal
