#include "spartan/rig/inspection/pairs_together.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

// The right eye of a pair turned, as a correction does.
CorrectedPair turned(Rig rig, const std::string& pair, const Eigen::Vector3d& turn) {
  for (Camera& camera : rig.cameras) {
    if (camera.name != rig.find_pair(pair)->right) continue;
    camera.mount_from_camera = camera.mount_from_camera * Pose(exp_so3(turn), Eigen::Vector3d::Zero());
  }
  return {pair, std::move(rig)};
}

void expect_stands_as_in(const CorrectedPair& wanted, const Rig& rig) {
  const Pose between = left_from_right(wanted.rig, wanted.pair).inverse() * left_from_right(rig, wanted.pair);
  EXPECT_LT(between.translation().norm(), 1e-12) << wanted.pair;
  EXPECT_LT(rotation_angle(between), 1e-12) << wanted.pair;
}

TEST(PairsTogether, NothingCorrectedChangesNothing) {
  const Rig rig = row_of_cameras();
  const RigOfPairs together = take_together(rig, {{"narrow", rig}, {"wide", rig}, {"all", rig}});
  EXPECT_EQ(together.rig, rig);
  EXPECT_THAT(together.left_out, IsEmpty());
}

// The middle camera is the right eye of one pair and the left eye of the other.
TEST(PairsTogether, ACameraOfTwoPairsKeepsBothCorrections) {
  const Rig rig = row_of_cameras();
  const CorrectedPair narrow = turned(rig, "narrow", {0.01, 0.002, -0.003}),
                      wide = turned(rig, "wide", {-0.004, 0.001, 0.02}), sound{"wide", rig};
  for (const auto& pairs : {std::vector{narrow, wide}, {wide, narrow}, {narrow, sound}, {sound, narrow}}) {
    const RigOfPairs together = take_together(rig, pairs);
    EXPECT_THAT(together.left_out, IsEmpty());
    for (const CorrectedPair& pair : pairs) expect_stands_as_in(pair, together.rig);
  }
}

TEST(PairsTogether, WhatContradictsPairsBeforeIsLeftOut) {
  const Rig rig = row_of_cameras();
  const CorrectedPair narrow = turned(rig, "narrow", {0.01, 0, 0}), wide = turned(rig, "wide", {0, 0, 0.02});
  const RigOfPairs together = take_together(rig, {narrow, wide, {"all", rig}});
  EXPECT_THAT(together.left_out, ElementsAre("all"));
  expect_stands_as_in(narrow, together.rig);
  expect_stands_as_in(wide, together.rig);
  // Another focal length of a camera by which a pair before was judged.
  CorrectedPair longer = narrow;
  longer.rig.cameras[1].model = PinholeModel{510, 510, 319.5, 239.5};
  EXPECT_THAT(take_together(rig, {longer, {"wide", rig}}).left_out, ElementsAre("wide"));
  EXPECT_EQ(take_together(rig, {longer, {"wide", rig}}).rig, longer.rig) << "the first one has its way";
}

TEST(PairsTogether, ExchangedEyesAreTakenIn) {
  const Rig rig = row_of_cameras();
  CorrectedPair wide{"wide", rig};
  std::swap(wide.rig.pairs[1].left, wide.rig.pairs[1].right);
  const RigOfPairs together = take_together(rig, {turned(rig, "narrow", {0.01, 0, 0}), wide});
  EXPECT_EQ(together.rig.pairs[1].left, "right");
  expect_stands_as_in(wide, together.rig);
}

}  // namespace
}  // namespace spartan
