#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "spartan/calibration/pair_check.h"

namespace spartan {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Three cameras in a row and the pairs between them.
Rig row_of_cameras() {
  Rig rig;
  for (const auto& [name, x] : {std::pair{"left", 0.0}, {"middle", 0.1}, {"right", 0.3}}) {
    Camera camera;
    camera.name = name;
    camera.size = {640, 480};
    camera.model = PinholeModel{500, 500, 319.5, 239.5};
    camera.mount_from_camera = Pose(exp_so3({0.1, 0.2, -0.1}), {x, 0.02, 0.7});
    rig.cameras.push_back(camera);
  }
  rig.pairs = {{"narrow", "left", "middle"}, {"wide", "middle", "right"}, {"all", "left", "right"}};
  return rig;
}

Pose left_from_right(const Rig& rig, const std::string& pair) {
  return rig.right_from_left(*rig.find_pair(pair)).inverse();
}

// The right camera of a pair rotated, as a correction does.
CorrectedPair rotated(Rig rig, const std::string& pair, const Eigen::Vector3d& rotation) {
  for (Camera& camera : rig.cameras) {
    if (camera.name != rig.find_pair(pair)->right) continue;
    camera.mount_from_camera = camera.mount_from_camera * Pose(exp_so3(rotation), Eigen::Vector3d::Zero());
  }
  return {pair, std::move(rig)};
}

void expect_relative_pose_of(const CorrectedPair& wanted, const Rig& rig) {
  const Pose between = left_from_right(wanted.rig, wanted.pair).inverse() * left_from_right(rig, wanted.pair);
  EXPECT_LT(between.translation().norm(), 1e-12) << wanted.pair;
  EXPECT_LT(rotation_angle(between), 1e-12) << wanted.pair;
}

TEST(MergeCorrections, WithoutCorrectionsTheRigIsUnchanged) {
  const Rig rig = row_of_cameras();
  const MergedRig merged = merge_corrections(rig, {{"narrow", rig}, {"wide", rig}, {"all", rig}});
  EXPECT_EQ(merged.rig, rig);
  EXPECT_THAT(merged.discarded, IsEmpty());
}

// The middle camera is the right camera of one pair and the left camera of the other.
TEST(MergeCorrections, SharedCameraKeepsBothCorrections) {
  const Rig rig = row_of_cameras();
  const CorrectedPair narrow = rotated(rig, "narrow", {0.01, 0.002, -0.003}),
                      wide = rotated(rig, "wide", {-0.004, 0.001, 0.02}), unchanged{"wide", rig};
  for (const auto& pairs : {std::vector{narrow, wide}, {wide, narrow}, {narrow, unchanged}, {unchanged, narrow}}) {
    const MergedRig merged = merge_corrections(rig, pairs);
    EXPECT_THAT(merged.discarded, IsEmpty());
    for (const CorrectedPair& pair : pairs) expect_relative_pose_of(pair, merged.rig);
  }
}

TEST(MergeCorrections, ContradictingCorrectionsAreDiscarded) {
  const Rig rig = row_of_cameras();
  const CorrectedPair narrow = rotated(rig, "narrow", {0.01, 0, 0}), wide = rotated(rig, "wide", {0, 0, 0.02});
  const MergedRig merged = merge_corrections(rig, {narrow, wide, {"all", rig}});
  EXPECT_THAT(merged.discarded, ElementsAre("all"));
  expect_relative_pose_of(narrow, merged.rig);
  expect_relative_pose_of(wide, merged.rig);
  // A correction with another focal length for a camera of an earlier pair.
  CorrectedPair longer = narrow;
  longer.rig.cameras[1].model = PinholeModel{510, 510, 319.5, 239.5};
  EXPECT_THAT(merge_corrections(rig, {longer, {"wide", rig}}).discarded, ElementsAre("wide"));
  EXPECT_EQ(merge_corrections(rig, {longer, {"wide", rig}}).rig, longer.rig) << "the first correction is kept";
}

TEST(MergeCorrections, SwappedCamerasAreApplied) {
  const Rig rig = row_of_cameras();
  CorrectedPair wide{"wide", rig};
  std::swap(wide.rig.pairs[1].left, wide.rig.pairs[1].right);
  const MergedRig merged = merge_corrections(rig, {rotated(rig, "narrow", {0.01, 0, 0}), wide});
  EXPECT_EQ(merged.rig.pairs[1].left, "right");
  expect_relative_pose_of(wide, merged.rig);
}

}  // namespace
}  // namespace spartan
