#include "spartan/calibration/internal/pair_correction.h"

#include <gtest/gtest.h>

namespace spartan::internal {
namespace {

// A pair of 640 x 480 px whose left camera has a vignetting with its own centre.
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

// The left camera after a size change.
Camera corrected_left(const Rig& rig, ImageSize size, const SizeChange& change = {}) {
  PairHypothesis hypothesis;
  hypothesis.left = *rig.find_camera("left");
  hypothesis.right = *rig.find_camera("right");
  hypothesis.left_from_right = rig.right_from_left(rig.pairs[0]).inverse();
  hypothesis.left.size = hypothesis.right.size = size;
  hypothesis.size = change;
  return *corrected_rig(rig, rig.pairs[0], hypothesis, {}, false).find_camera("left");
}

// The centre is in pixels of the calibration: (300.5 + 0.5) / 2 − 0.5 in images half as large.
TEST(PairCorrection, VignettingCentreScalesWithTheImage) {
  const Rig rig = rig_with_vignetting();
  EXPECT_EQ(corrected_left(rig, {640, 480}), rig.cameras[0]) << "unchanged";
  const Camera half = corrected_left(rig, {320, 240});
  EXPECT_EQ(half.size, (ImageSize{320, 240}));
  EXPECT_EQ(half.vignetting.centre_px, Eigen::Vector2d(150, 129.5));
  EXPECT_EQ(half.vignetting.coefficients, rig.cameras[0].vignetting.coefficients) << "they do not depend on the size";
  EXPECT_EQ(corrected_left(rig, {640, 400}).vignetting, rig.cameras[0].vignetting)
      << "another aspect ratio: unknown crop";
  EXPECT_EQ(corrected_left(rig, {640, 480}, {true, true, true, 2}).vignetting.centre_px, Eigen::Vector2d(601.5, 519.5));
  EXPECT_EQ(corrected_left(rig, {640, 480}, {true, true, false, 2}).vignetting, rig.cameras[0].vignetting);
  EXPECT_EQ(corrected_left(rig, {640, 480}, {false, true, true, 2}).vignetting, rig.cameras[0].vignetting);
}

// The right image was cropped: everything in it is higher.
TEST(PairCorrection, VignettingCentreMovesWithTheRowShift) {
  Rig rig = rig_with_vignetting();
  rig.cameras[1].vignetting = rig.cameras[0].vignetting;
  PairHypothesis hypothesis;
  hypothesis.left = rig.cameras[0];
  hypothesis.right = rig.cameras[1];
  hypothesis.left_from_right = rig.right_from_left(rig.pairs[0]).inverse();
  hypothesis.row_shift_px = -7;
  const Rig corrected = corrected_rig(rig, rig.pairs[0], hypothesis, {}, false);
  EXPECT_EQ(corrected.cameras[0].vignetting, rig.cameras[0].vignetting);
  EXPECT_EQ(corrected.cameras[1].vignetting.centre_px, Eigen::Vector2d(300.5, 252.5));
}

}  // namespace
}  // namespace spartan::internal
