#include "spartan/odometry/internal/rival_motion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "spartan/numerics/random.h"

namespace spartan::internal {
namespace {

using ::testing::HasSubstr;

const RectifiedStereo kPair{{640, 480}, 500, {319.5, 239.5}, 0.12};
const Pose kScene = Pose::from_translation({0, 0, 0.1});
// 2 m away: 10 px a frame to the right of where the scene would be.
const Pose kObject = kScene * Pose::from_translation({-0.04, 0, 0});

struct Part {
  int count;
  Eigen::Vector2d from, to;  // pixels
  Pose motion;
  double distance_m = 2;
};
const Part kWholeView{100, {0, 0}, {639, 479}, kScene};
const Part kCompact{150, {220, 140}, {420, 340}, kObject};

std::vector<LandmarkMatch> matches_of(const std::vector<Part>& parts, double noise_px = 0.2) {
  Random random(5);
  std::vector<LandmarkMatch> matches;
  for (const Part& part : parts) {
    for (int i = 0; i < part.count;) {
      LandmarkMatch m;
      m.point.pixel = {random.uniform(part.from.x(), part.to.x()), random.uniform(part.from.y(), part.to.y())};
      m.point.disparity = 60 / (part.distance_m * random.uniform(0.9, 1.1));
      const auto p = project_anchored(kPair, m.point, part.motion.inverse());
      if (!p) continue;
      m.measured = p->measured;
      for (int k = 0; k < 3; ++k) m.measured[k] += noise_px * random.normal();
      m.covariance = 0.04 * Eigen::Matrix3d::Identity();
      m.landmark = matches.size();
      matches.push_back(m);
      ++i;
    }
  }
  return matches;
}

double apart(const Pose& a, const Pose& b) {
  return (a.inverse() * b).translation().norm();
}

struct Found {
  std::vector<LandmarkMatch> matches;
  MotionFit first;
  std::optional<MotionFit> rival;
};

Found search(const std::vector<Part>& parts, const Pose& predicted = kScene, double noise_px = 0.2) {
  const MotionEstimator estimator{MotionEstimationOptions{}};
  Found found{matches_of(parts, noise_px), {}, {}};
  found.first = estimator.coarse(kPair, found.matches).value();
  found.rival = find_rival(estimator, kPair, found.matches, found.first, predicted);
  return found;
}

TEST(RivalMotion, IsFoundAmongTheOutliers) {
  const Found found = search({kWholeView, kCompact});
  EXPECT_LT(apart(found.first.previous_from_current, kObject), 0.008);
  ASSERT_TRUE(found.rival);
  EXPECT_LT(apart(found.rival->previous_from_current, kScene), 0.008);
  EXPECT_EQ(found.rival->inliers, kWholeView.count);
  for (std::size_t i = 0; i < found.matches.size(); ++i) EXPECT_NE(found.rival->inlier[i], found.first.inlier[i]) << i;
}

TEST(RivalMotion, AgreesWithThePredictionBetterThanTheFirstMotion) {
  EXPECT_FALSE(search({kWholeView}).rival);
  EXPECT_FALSE(search({kCompact}).rival);
  EXPECT_FALSE(search({kWholeView, kCompact}, kObject).rival) << "the first motion is the predicted one";
  EXPECT_FALSE(search({kWholeView, kCompact}, Pose::from_translation({0, 0.3, 0})).rival) << "neither is";
  Part few = kWholeView;
  few.count = 30;
  EXPECT_TRUE(search({few, kCompact}).rival) << "30 against 150";
  few.count = 12;
  EXPECT_FALSE(search({few, kCompact}).rival);
  // Outliers without a common motion.
  std::vector<Part> scattered{kCompact};
  for (int i = 0; i < 80; ++i)
    scattered.push_back({1, {0, 0}, {639, 479}, Pose::from_translation({0.02 * (i - 40), 0.04 * (i % 9 - 4), 0})});
  EXPECT_FALSE(search(scattered).rival);
  // Noise of the size of the threshold leaves outliers, but they agree with the same motion.
  Part noisy = kCompact;
  noisy.count = 300;
  EXPECT_FALSE(search({noisy}, kScene, 2.0).rival);
}

// 60 landmarks of earlier frames against 150 of an object that has come into view, and 10 of the former that it hides.
TEST(RivalMotion, EstablishedLandmarksTellTheScene) {
  const MotionEstimator estimator{MotionEstimationOptions{}};
  Part earlier = kWholeView, hidden = kCompact;
  earlier.count = 60;
  hidden.count = 10;
  std::vector<LandmarkMatch> established = matches_of({earlier, hidden}), matches = matches_of({earlier, kCompact});
  for (std::size_t i = 0; i < 60; ++i) matches[i].established = true;
  const MotionFit object = estimator.coarse(kPair, matches).value();
  ASSERT_LT(apart(object.previous_from_current, kObject), 0.008);
  EXPECT_TRUE(is_of_young_landmarks(matches, object));
  const auto chosen = find_established_motion(estimator, kPair, established, matches, object, kScene);
  ASSERT_TRUE(chosen);
  EXPECT_LT(apart(chosen->fit.previous_from_current, kScene), 0.012);
  EXPECT_LT(apart(chosen->object.value(), kObject), 0.008);
  EXPECT_EQ(chosen->reason, "60 landmarks of several frames follow one motion, 10 another, that of an object");
  // Landmarks of the scene follow the largest set: it is the scene.
  const std::vector<LandmarkMatch> view = matches_of({kWholeView});
  MotionFit scene = estimator.coarse(kPair, view).value();
  EXPECT_FALSE(find_established_motion(estimator, kPair, matches_of({earlier}), view, scene, kScene));
  // A coarse motion may be so inaccurate that few other landmarks agree with it; it is the same motion nevertheless.
  scene.previous_from_current = kScene * exp_se3((Vector6d() << 0.03, 0, 0, 0, 0, 0).finished());
  EXPECT_FALSE(find_established_motion(estimator, kPair, matches_of({earlier}), view, scene, kScene));
  // Too few of them are left.
  earlier.count = 14;
  EXPECT_FALSE(find_established_motion(estimator, kPair, matches_of({earlier}), matches, object, kScene));
  for (LandmarkMatch& match : matches) match.established = true;
  EXPECT_FALSE(is_of_young_landmarks(matches, object));
}

TEST(RivalMotion, AMotionIsAsPredictedWithinAFewPixels) {
  const std::vector<LandmarkMatch> matches = matches_of({kWholeView});
  const MotionFit fit = MotionEstimator{MotionEstimationOptions{}}.coarse(kPair, matches).value();
  EXPECT_TRUE(is_as_predicted(kPair, matches, fit, kScene));
  EXPECT_TRUE(is_as_predicted(kPair, matches, fit, kScene * Pose::from_translation({0.01, 0, 0})));  // 2.5 px
  EXPECT_FALSE(is_as_predicted(kPair, matches, fit, kScene * Pose::from_translation({0.02, 0, 0})));
}

// Few points at 25 m leave the translation undetermined: at the distance of the object their motion is farther from the
// prediction than that of the object.
TEST(RivalMotion, IsFoundByDistantPoints) {
  const Part distant{25, {0, 0}, {639, 200}, kScene, 25};
  const Found found = search({distant, kCompact}, kScene, 1.0);
  ASSERT_TRUE(found.rival);
  EXPECT_GE(found.rival->inliers, 20);
  EXPECT_GT(apart(found.rival->previous_from_current, kScene), 0.04) << "otherwise this tests nothing";
}

TEST(RivalMotion, MatchesOfTheObjectAreTold) {
  std::vector<LandmarkMatch> matches = matches_of({kWholeView, kCompact});
  const std::vector<bool> follows = follows_object(kPair, matches, kScene, kObject);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    EXPECT_EQ(follows[i], i >= static_cast<std::size_t>(kWholeView.count)) << i;
  }
  const std::vector<bool> same = follows_object(kPair, matches, kScene, kScene * Pose::from_translation({0.001, 0, 0}));
  EXPECT_EQ(std::count(same.begin(), same.end(), true), 0) << "both motions predict the same places";
}

TEST(RivalMotion, IsChosenUnlessItIsCompactInAWideScene) {
  const Found found = search({kWholeView, kCompact});
  ASSERT_TRUE(found.rival);
  const ChosenMotion scene = choose_motion(found.matches, found.first, *found.rival);
  EXPECT_LT(apart(scene.fit.previous_from_current, kScene), 0.008);
  ASSERT_TRUE(scene.object);
  EXPECT_LT(apart(*scene.object, kObject), 0.008);
  EXPECT_EQ(scene.reason, "100 matches follow the predicted motion, 150 that of an object");
  // A rover that has just started to follow another one: what moves with the camera was predicted.
  Part scenery = kWholeView;
  scenery.count = 200;
  const Found started = search({scenery, kCompact}, kObject);
  ASSERT_TRUE(started.rival);
  const ChosenMotion kept = choose_motion(started.matches, started.first, *started.rival);
  EXPECT_LT(apart(kept.fit.previous_from_current, kScene), 0.008);
  EXPECT_THAT(kept.reason, HasSubstr("ambiguous"));
  EXPECT_FALSE(kept.object);
}

// Near landmarks that move with the camera would be behind it by a prediction that drives past them.
TEST(RivalMotion, PointsBehindTheCameraDoNotAgreeWithAPrediction) {
  const std::vector<LandmarkMatch> matches = matches_of({{60, {220, 140}, {420, 340}, Pose(), 1}});
  MotionFit fit;
  fit.inlier.assign(matches.size(), true);
  fit.inliers = static_cast<int>(matches.size());
  EXPECT_TRUE(is_as_predicted(kPair, matches, fit, Pose()));
  EXPECT_FALSE(is_as_predicted(kPair, matches, fit, Pose::from_translation({0, 0, 7})));
}

}  // namespace
}  // namespace spartan::internal
