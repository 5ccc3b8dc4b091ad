#include "spartan/odometry/internal/motion_estimator.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "spartan/numerics/random.h"

namespace spartan::internal {
namespace {

const RectifiedStereo kStereo{{640, 480}, 500, {319.5, 239.5}, 0.12};

struct World {
  int landmarks = 120;
  double pixel_sigma = 0, disparity_sigma = 0, anchor_sigma = 0;
  int outliers = 0;
  double offset = 0;  // missing from all measured disparities
  // Every second landmark is measured in this camera alone; both: none is.
  MeasuredIn every_second = MeasuredIn::both, others = MeasuredIn::both;
};

// Landmarks anchored in the previous frame, 1 … 20 m away.
std::vector<LandmarkMatch> make_matches(const World& world, const Pose& previous_from_current, Random& random) {
  std::vector<LandmarkMatch> matches;
  while (static_cast<int>(matches.size()) < world.landmarks) {
    LandmarkMatch m;
    m.landmark = matches.size();
    m.point.pixel = {random.uniform(0, 639), random.uniform(0, 479)};
    m.point.disparity = 60 / random.uniform(1, 20);
    const auto p = project_anchored(kStereo, m.point, previous_from_current.inverse());
    if (!p) continue;
    m.measured = p->measured;
    for (int i = 0; i < 2; ++i) m.measured[i] += world.pixel_sigma * random.normal();
    m.measured[2] += world.disparity_sigma * random.normal() - world.offset;
    m.point.disparity += world.anchor_sigma * random.normal() - world.offset;
    m.disparity_variance = std::pow(world.anchor_sigma, 2);
    const double pixel = std::max(world.pixel_sigma, 0.01), disparity = std::max(world.disparity_sigma, 0.01);
    m.covariance = Eigen::Vector3d(pixel * pixel, pixel * pixel, disparity * disparity).asDiagonal();
    if (static_cast<int>(matches.size()) < world.outliers) {
      m.measured += Eigen::Vector3d(random.uniform(-40, 40), random.uniform(-40, 40), random.uniform(0, 20));
    }
    const MeasuredIn camera = matches.size() % 2 == 0 ? world.every_second : world.others;
    if (camera != MeasuredIn::both) {
      const double u = m.measured.x() - (camera == MeasuredIn::right ? p->measured.z() : 0);
      m.set_measured_in_one(camera, {u, m.measured.y()}, m.covariance.topLeftCorner<2, 2>(), p->measured.z() + 1);
    }
    matches.push_back(m);
  }
  return matches;
}

Pose some_motion(Random& random) {
  Vector6d t;
  for (int i = 0; i < 6; ++i) t[i] = random.uniform(-0.05, 0.05);
  t[2] += 0.3;
  return exp_se3(t);
}

TEST(MotionEstimator, RecoversAnExactMotionWithoutAStartValue) {
  Random random(1);
  const MotionEstimator estimation{MotionEstimationOptions{}};
  for (int trial = 0; trial < 10; ++trial) {
    const Pose truth = some_motion(random);
    const auto matches = make_matches({}, truth, random);
    const auto coarse = estimation.coarse(kStereo, matches);
    ASSERT_TRUE(coarse.has_value());
    EXPECT_EQ(coarse->inliers, 120);
    const auto fine = estimation.fine(kStereo, matches, Pose());
    ASSERT_TRUE(fine.has_value());
    EXPECT_LT(log_se3(truth.inverse() * fine->previous_from_current).norm(), 1e-7);
  }
}

TEST(MotionEstimator, IsRobustAgainstFiftyPercentOutliers) {
  Random random(2);
  const MotionEstimator estimation{MotionEstimationOptions{}};
  for (int trial = 0; trial < 10; ++trial) {
    const Pose truth = some_motion(random);
    const auto matches = make_matches({.pixel_sigma = 0.2, .disparity_sigma = 0.2, .outliers = 60}, truth, random);
    const auto coarse = estimation.coarse(kStereo, matches);
    ASSERT_TRUE(coarse.has_value());
    EXPECT_GE(coarse->inliers, 55);
    const auto fine = estimation.fine(kStereo, matches, coarse->previous_from_current);
    ASSERT_TRUE(fine.has_value());
    EXPECT_LT((truth.inverse() * fine->previous_from_current).translation().norm(), 0.01);
    EXPECT_NEAR(fine->inliers, 60, 8);
  }
}

// Mean NEES eᵀ Σ⁻¹ e over trials; 6 for a consistent covariance.
double mean_nees(const World& world, const MotionEstimationOptions& options, DisparityOffset offset) {
  Random random(3);
  const MotionEstimator estimation{options};
  const int trials = 300;
  double sum = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const Pose truth = some_motion(random);
    World drawn = world;
    if (offset.variance > 0) drawn.offset = std::sqrt(offset.variance) * random.normal();
    const auto fit = estimation.fine(kStereo, make_matches(drawn, truth, random), truth, offset);
    if (!fit) return 1e9;
    const Vector6d error = log_se3(truth.inverse() * fit->previous_from_current);
    sum += error.dot(fit->covariance.ldlt().solve(error));
  }
  return sum / trials;
}

TEST(MotionEstimator, CovarianceIsConsistent) {
  // 300 trials with 6 degrees of freedom: the mean of a consistent estimator has a standard deviation of 0.2.
  const World noisy{.pixel_sigma = 0.2, .disparity_sigma = 0.3, .anchor_sigma = 0.25};
  MotionEstimationOptions plain;
  plain.robust = false;
  EXPECT_NEAR(mean_nees(noisy, plain, {}), 6, 0.9);
  EXPECT_NEAR(mean_nees(noisy, {}, {}), 6, 1.2);  // the Cauchy loss assumes tails that this noise has not
  EXPECT_NEAR(mean_nees(noisy, plain, {0, 0.01}), 6, 0.9);
}

TEST(MotionEstimator, CovarianceIsConsistentWhereLandmarksAreSeenByOneCamera) {
  MotionEstimationOptions plain;
  plain.robust = false;
  for (const MeasuredIn camera : {MeasuredIn::left, MeasuredIn::right}) {
    World noisy{.pixel_sigma = 0.2, .disparity_sigma = 0.3, .anchor_sigma = 0.25, .every_second = camera};
    EXPECT_NEAR(mean_nees(noisy, plain, {}), 6, 0.9);
    EXPECT_NEAR(mean_nees(noisy, {}, {}), 6, 1.2);
    noisy.others = camera;
    EXPECT_NEAR(mean_nees(noisy, plain, {}), 6, 0.9);
  }
}

TEST(MotionEstimator, RecoversAMotionFromPositionsInOneImage) {
  Random random(7);
  const MotionEstimator estimation{MotionEstimationOptions{}};
  for (const MeasuredIn camera : {MeasuredIn::left, MeasuredIn::right}) {
    for (int trial = 0; trial < 10; ++trial) {
      const Pose truth = some_motion(random);
      const World world{.pixel_sigma = 0.1, .outliers = 40, .every_second = camera, .others = camera};
      const auto matches = make_matches(world, truth, random);
      const auto coarse = estimation.coarse(kStereo, matches);
      ASSERT_TRUE(coarse.has_value());
      EXPECT_GE(coarse->inliers, 75);
      EXPECT_LT((truth.inverse() * coarse->previous_from_current).translation().norm(), 0.05);
      const auto fine = estimation.fine(kStereo, matches, coarse->previous_from_current);
      ASSERT_TRUE(fine.has_value());
      EXPECT_LT((truth.inverse() * fine->previous_from_current).translation().norm(), 0.01);
      EXPECT_NEAR(fine->inliers, 80, 4);
      EXPECT_NEAR(fine->rms_px, 0.1, 0.02);
    }
  }
}

TEST(MotionEstimator, NoiseScaleFollowsUnspecifiedNoise) {
  Random random(4);
  World world{.pixel_sigma = 0.5, .disparity_sigma = 0.5};
  auto matches = make_matches(world, Pose(), random);
  for (LandmarkMatch& m : matches) m.covariance *= 0.04;
  const auto fit = MotionEstimator{MotionEstimationOptions{}}.fine(kStereo, matches, Pose());
  ASSERT_TRUE(fit.has_value());
  EXPECT_NEAR(fit->noise_scale, 5, 0.8);
}

TEST(MotionEstimator, EstimatesTheDisparityOffsetFromForwardMotion) {
  Random random(5);
  const Pose truth = Pose::from_translation({0, 0, 0.5});
  const World world{.landmarks = 400, .pixel_sigma = 0.05, .disparity_sigma = 0.1, .anchor_sigma = 0.1, .offset = 0.2};
  const auto matches = make_matches(world, truth, random);
  const MotionEstimator estimation{MotionEstimationOptions{}};
  const auto with = estimation.fine(kStereo, matches, Pose(), {0, 0.09});
  const auto without = estimation.fine(kStereo, matches, Pose());
  ASSERT_TRUE(with && without);
  EXPECT_NEAR(with->offset.value, 0.2, 0.05);
  EXPECT_LT(with->offset.variance, 0.03 * 0.03);
  EXPECT_NEAR(without->offset.value, 0, 1e-6);
  EXPECT_LT(std::abs(with->previous_from_current.translation().z() - 0.5), 0.003);
  EXPECT_GT(without->previous_from_current.translation().z() - 0.5,
            0.004);  // all points are nearer than their disparities say
}

TEST(MotionEstimator, RejectsTooFewMatches) {
  Random random(6);
  const MotionEstimator estimation{MotionEstimationOptions{}};
  EXPECT_FALSE(estimation.coarse(kStereo, {}).has_value());
  EXPECT_FALSE(estimation.fine(kStereo, {}, Pose()).has_value());
  EXPECT_FALSE(estimation.fine(kStereo, make_matches({.landmarks = 4}, Pose(), random), Pose()).has_value());
}

}  // namespace
}  // namespace spartan::internal
