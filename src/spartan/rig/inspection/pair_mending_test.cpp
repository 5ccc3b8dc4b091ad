#include "spartan/rig/inspection/pair_mending.h"

#include <gtest/gtest.h>

namespace spartan {
namespace {

// A pair of 640 x 480 px whose left eye has a vignetting with a centre of its own.
Rig rig_with_vignetting() {
  const auto camera = [](const char* name) {
    Camera made;
    made.name = name;
    made.size = {640, 480};
    made.model = PinholeModel{500, 500, 319.5, 239.5};
    made.vignetting.coefficients = {-0.4};
    made.self_mask = "mask.png";
    return made;
  };
  Rig rig = rig_of_one_pair("front", camera("left"), camera("right"), Pose::from_translation({-0.12, 0, 0}));
  rig.cameras[0].vignetting.centre_px = Eigen::Vector2d(300.5, 259.5);
  return rig;
}

// The rig with its pair's left eye as the change makes it.
Camera mended_left(const Rig& rig, ImageSize size, const SizeChange& change = {}) {
  PairBelief belief;
  belief.left = *rig.find_camera("left");
  belief.right = *rig.find_camera("right");
  belief.left_from_right = rig.right_from_left(rig.pairs[0]).inverse();
  belief.left.size = belief.right.size = size;
  belief.size = change;
  return *mended_rig(rig, rig.pairs[0], belief, {}, false).find_camera("left");
}

// It is counted in the calibration's pixels: (300.5 + 0.5) / 2 − 0.5 in pictures half as large.
TEST(PairMending, VignettingGoesWithTheSize) {
  const Rig rig = rig_with_vignetting();
  EXPECT_EQ(mended_left(rig, {640, 480}), rig.cameras[0]) << "nothing changed";
  const Camera half = mended_left(rig, {320, 240});
  EXPECT_EQ(half.size, (ImageSize{320, 240}));
  EXPECT_EQ(half.vignetting.centre_px, Eigen::Vector2d(150, 129.5));
  EXPECT_EQ(half.vignetting.coefficients, rig.cameras[0].vignetting.coefficients) << "they are relative to the size";
  EXPECT_EQ(mended_left(rig, {640, 400}).vignetting, rig.cameras[0].vignetting) << "a part of the pictures: not known";
  EXPECT_EQ(mended_left(rig, {640, 480}, {true, true, true, 2}).vignetting.centre_px, Eigen::Vector2d(601.5, 519.5));
  EXPECT_EQ(mended_left(rig, {640, 480}, {true, true, false, 2}).vignetting, rig.cameras[0].vignetting);
  EXPECT_EQ(mended_left(rig, {640, 480}, {false, true, true, 2}).vignetting, rig.cameras[0].vignetting);
}

// The right picture was cut: everything in it lies higher.
TEST(PairMending, VignettingGoesWithMovedRows) {
  Rig rig = rig_with_vignetting();
  rig.cameras[1].vignetting = rig.cameras[0].vignetting;
  PairBelief belief;
  belief.left = rig.cameras[0];
  belief.right = rig.cameras[1];
  belief.left_from_right = rig.right_from_left(rig.pairs[0]).inverse();
  belief.rows_lower_px = -7;
  const Rig mended = mended_rig(rig, rig.pairs[0], belief, {}, false);
  EXPECT_EQ(mended.cameras[0].vignetting, rig.cameras[0].vignetting);
  EXPECT_EQ(mended.cameras[1].vignetting.centre_px, Eigen::Vector2d(300.5, 252.5));
}

}  // namespace
}  // namespace spartan
