// Landmarks that do not determine the motion, or that a motion puts behind the camera.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "spartan/numerics/random.h"
#include "spartan/odometry/internal/motion_estimator.h"

namespace spartan::internal {
namespace {

const RectifiedStereo kGeometry{{640, 480}, 500, {319.5, 239.5}, 0.12};

LandmarkMatch match_at(const Eigen::Vector2d& pixel, double disparity, const Pose& current_from_previous) {
  LandmarkMatch match;
  match.point = {pixel, disparity};
  const auto seen = project_anchored(kGeometry, match.point, current_from_previous);
  if (seen) match.measured = seen->measured;
  match.covariance = 0.04 * Eigen::Matrix3d::Identity();
  return match;
}

// Landmarks 2 … 12 m away, moved without noise.
std::vector<LandmarkMatch> spread_matches(int count, const Pose& current_from_previous) {
  Random random(8);
  std::vector<LandmarkMatch> matches;
  matches.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    matches.push_back(match_at({random.uniform(50, 590), random.uniform(50, 430)}, 60 / random.uniform(2, 12),
                               current_from_previous));
  }
  return matches;
}

double error_of(const Pose& estimate, const Pose& previous_from_current) {
  return log_se3(previous_from_current.inverse() * estimate).norm();
}

const Pose kForward = Pose::from_translation({0.02, -0.01, 0.3});
const MotionEstimator kEstimator{MotionEstimationOptions{}};

TEST(DegenerateMotion, ThreeLandmarksAreNeededForACoarseAndSixForAFineMotion) {
  for (const int count : {0, 2, 3, 5, 6}) {
    const auto matches = spread_matches(count, kForward.inverse());
    const auto coarse = kEstimator.coarse(kGeometry, matches);
    const auto fine = kEstimator.fine(kGeometry, matches, Pose());
    EXPECT_EQ(coarse.has_value(), count >= 3) << count;
    EXPECT_EQ(fine.has_value(), count >= 6) << count;
    EXPECT_LT(coarse ? error_of(coarse->previous_from_current, kForward) : 0, 1e-9) << count;
    EXPECT_LT(fine ? error_of(fine->previous_from_current, kForward) : 0, 1e-7) << count;
  }
}

TEST(DegenerateMotion, LandmarksOnALineGiveNoCoarseMotion) {
  std::vector<LandmarkMatch> line;
  line.reserve(20);
  for (int i = 0; i < 20; ++i) line.push_back(match_at({100.0 + 20 * i, 239.5}, 12, kForward.inverse()));
  EXPECT_FALSE(kEstimator.coarse(kGeometry, line));
}

// Landmarks 133 m away before and 100 m after the motion, or the other way: one of the two disparities is below 0.5 px.
TEST(DegenerateMotion, DistantLandmarksAreNotPartOfTheCoarseFit) {
  Random random(9);
  for (const double forward_m : {33.3, -33.3}) {
    std::vector<LandmarkMatch> distant;
    distant.reserve(20);
    for (int i = 0; i < 20; ++i) {
      distant.push_back(match_at({random.uniform(200, 440), random.uniform(150, 330)}, forward_m > 0 ? 0.45 : 0.6,
                                 Pose::from_translation({0, 0, -forward_m})));
    }
    EXPECT_FALSE(kEstimator.coarse(kGeometry, distant)) << forward_m;
    for (LandmarkMatch& match : distant) match.measured.x() += 30;  // would pull the fit
    const auto near = spread_matches(20, kForward.inverse());
    distant.insert(distant.end(), near.begin(), near.end());
    const auto coarse = kEstimator.coarse(kGeometry, distant);
    ASSERT_TRUE(coarse);
    EXPECT_LT(error_of(coarse->previous_from_current, kForward), 1e-6);
  }
}

// A start value that puts the nearest landmarks behind the camera: they have a cost, no gradient, and return.
TEST(DegenerateMotion, LandmarksBehindTheStartReturnToTheEstimate) {
  const Pose motion = Pose::from_translation({0, 0, 0.1});
  auto matches = spread_matches(60, motion.inverse());
  for (std::size_t i = 0; i < 4; ++i) {
    matches[i] = match_at({200.0 + 60 * static_cast<double>(i), 150}, 60 / 0.5, motion.inverse());
  }
  const auto fit = kEstimator.fine(kGeometry, matches, Pose::from_translation({0, 0, 0.7}));
  ASSERT_TRUE(fit);
  EXPECT_LT(error_of(fit->previous_from_current, motion), 1e-6);
  EXPECT_EQ(fit->inliers, 60);
}

TEST(DegenerateMotion, LandmarksThatStayBehindTheCameraAreOutliers) {
  auto matches = spread_matches(60, kForward.inverse());
  for (std::size_t i = 0; i < 4; ++i) {
    matches[i].point = {{200, 150}, 60 / 0.2};  // 0.2 m ahead, but the camera moves 0.3 m
    matches[i].measured = {200, 150, 100};
  }
  const auto fit = kEstimator.fine(kGeometry, matches, kForward);
  ASSERT_TRUE(fit);
  EXPECT_LT(error_of(fit->previous_from_current, kForward), 1e-7);
  EXPECT_EQ(fit->inliers, 56);
  EXPECT_NEAR(fit->rms_px, 0, 1e-6);
  for (std::size_t i = 0; i < 60; ++i) EXPECT_EQ(fit->inlier[i], i >= 4) << i;
}

TEST(DegenerateMotion, TheSpreadOfTheResidualsScalesTheCovariance) {
  auto matches = spread_matches(300, kForward.inverse());
  Random random(4);
  auto quiet = matches;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
    quiet[i].measured += 0.2 * noise;    // as specified
    matches[i].measured += 0.8 * noise;  // four times as much
  }
  const auto as_specified = kEstimator.fine(kGeometry, quiet, kForward);
  const auto noisy = kEstimator.fine(kGeometry, matches, kForward);
  ASSERT_TRUE(as_specified && noisy);
  EXPECT_NEAR(as_specified->noise_scale, 1, 0.15);
  EXPECT_NEAR(noisy->noise_scale, 4, 0.6);
  EXPECT_NEAR(as_specified->rms_px, 0.2, 0.02);
  EXPECT_NEAR(noisy->rms_px, 0.8, 0.08);
  EXPECT_NEAR(std::sqrt(noisy->covariance.trace() / as_specified->covariance.trace()), 4, 1);
}

}  // namespace
}  // namespace spartan::internal
