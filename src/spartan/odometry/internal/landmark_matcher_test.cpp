#include "spartan/odometry/internal/landmark_matcher.h"

#include <gtest/gtest.h>

#include "spartan/numerics/random.h"

namespace spartan::internal {
namespace {

const RectifiedStereo kMatchingStereo{{640, 480}, 500, {319.5, 239.5}, 0.12};

Descriptor descriptor(int kind) {
  Descriptor d{};
  d.bytes[static_cast<std::size_t>(kind)] = 127;
  return d;
}

Landmark landmark_at(double x, double y, int kind) {
  Landmark l;
  l.anchor_pixel = l.pixel = {x, y};
  l.disparity = 10;
  l.variance = 0.01;
  l.scale = 2;
  l.sign = 1;
  l.descriptor = descriptor(kind);
  return l;
}

ReconstructedFeature feature_at(double x, double y, int kind) {
  ReconstructedFeature f;
  f.feature.x = static_cast<float>(x);
  f.feature.y = static_cast<float>(y);
  f.feature.scale = 2;
  f.feature.sign = 1;
  f.feature.descriptor = descriptor(kind);
  return f;
}

LandmarkMatcher matching() {
  return {LandmarkMatchingOptions{}, LandmarkReconstructor{{}}, ThreadPool(1)};
}

LandmarkMemory memory_of(std::vector<Landmark> landmarks) {
  LandmarkMemory memory;
  memory.anchors.push_back({0, Pose()});
  memory.landmarks = std::move(landmarks);
  return memory;
}

TEST(LandmarkMatcher, GatesFeaturesAroundThePrediction) {
  const LandmarkMemory memory = memory_of({landmark_at(100, 100, 1), landmark_at(300, 200, 2)});
  const std::vector<ReconstructedFeature> features{feature_at(310, 205, 2), feature_at(220, 100, 1)};
  const std::vector<int> gated = matching().by_descriptor(memory, features, kMatchingStereo, Pose());
  EXPECT_EQ(gated, (std::vector<int>{-1, 0}));
  EXPECT_EQ(matching().by_descriptor(memory, features, kMatchingStereo, std::nullopt), (std::vector<int>{1, 0}));
  // Disparity 10 px is a depth of 6 m: a motion of 1.44 m to the left moves the image by 120 px to the right.
  const Pose step = Pose::from_translation({1.44, 0, 0});
  EXPECT_EQ(matching().by_descriptor(memory, features, kMatchingStereo, step), (std::vector<int>{1, -1}));
}

TEST(LandmarkMatcher, RejectsOtherSignsOtherScalesAndAmbiguousFeatures) {
  const LandmarkMemory memory = memory_of({landmark_at(100, 100, 1)});
  ReconstructedFeature other = feature_at(100, 100, 1);
  other.feature.sign = -1;
  EXPECT_EQ(matching().by_descriptor(memory, {other}, kMatchingStereo, Pose())[0], -1);
  other = feature_at(100, 100, 1);
  other.feature.scale = 5;
  EXPECT_EQ(matching().by_descriptor(memory, {other}, kMatchingStereo, Pose())[0], -1);
  const std::vector<ReconstructedFeature> duplicates{feature_at(100, 100, 1), feature_at(110, 100, 1)};
  EXPECT_EQ(matching().by_descriptor(memory, duplicates, kMatchingStereo, Pose())[0], -1);
}

TEST(LandmarkMatcher, AFeatureMatchesOneLandmarkOnly) {
  const LandmarkMemory memory = memory_of({landmark_at(100, 100, 1), landmark_at(105, 100, 1)});
  const std::vector<int> found = matching().by_descriptor(memory, {feature_at(102, 100, 1)}, kMatchingStereo, Pose());
  EXPECT_EQ((found[0] >= 0) + (found[1] >= 0), 1);
}

TEST(LandmarkMatcher, RigidityCheckRejectsPointsThatMoveAgainstTheOthers) {
  Random random(1);
  const Pose motion = exp_se3((Vector6d() << 0.1, 0, 0.2, 0, 0.05, 0.01).finished());
  std::vector<LandmarkMatch> matches;
  for (std::size_t i = 0; i < 60; ++i) {
    LandmarkMatch m;
    m.landmark = i;
    m.point = {{random.uniform(0, 639), random.uniform(0, 479)}, random.uniform(8, 40)};
    m.disparity_variance = 0.01;
    m.covariance = 0.01 * Eigen::Matrix3d::Identity();
    m.measured = project_anchored(kMatchingStereo, m.point, motion)->measured;
    if (i % 6 == 0) m.measured.z() *= 1.5;
    matches.push_back(m);
  }
  const std::vector<LandmarkMatch> kept = keep_rigid(kMatchingStereo, matches);
  EXPECT_EQ(kept.size(), 50u);
  for (const LandmarkMatch& m : kept) EXPECT_NE(m.landmark % 6, 0u);
}

}  // namespace
}  // namespace spartan::internal
