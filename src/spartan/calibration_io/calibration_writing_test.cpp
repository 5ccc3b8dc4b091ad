// Rigs that a format does not support are rejected with the name of the camera.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "spartan/calibration_io/calibration_files.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;

TEST(CalibrationWriting, UnsupportedCamerasAreNamed) {
  Camera left, right;
  left.name = "left";
  right.name = "right";
  left.size = right.size = {640, 480};
  const auto refusal = [&](const CameraModel& model, CalibrationFormat format, const char* path) {
    left.model = right.model = model;
    const Rig rig = rig_of_one_pair("r", left, right, Pose::from_translation({-0.1, 0, 0}));
    const auto files = to_calibration_files(rig, format, path);
    return files ? std::string("nothing") : files.error().message();
  };
  const PinholeModel pinhole{500, 500, 320, 240};
  const EquidistantModel fisheye(pinhole, {0.1, 0.1, 0.1, 0.1});
  const RadialTangentialModel rational(pinhole, {0.1, 0, 0, 0, 0, 0.1, 0, 0});
  const CahvModel skewed{pinhole, 0.5};
  EXPECT_THAT(refusal(fisheye, CalibrationFormat::kitti, "calib.txt"),
              HasSubstr("cameras.left: kitti supports rectified"));
  EXPECT_THAT(refusal(fisheye, CalibrationFormat::tsai, "a.tsai"),
              HasSubstr("cameras.left: .tsai files do not support the model equi"));
  EXPECT_THAT(refusal(fisheye, CalibrationFormat::mrcal, "a.cameramodel"),
              HasSubstr("cameras.left: mrcal files do not support"));
  EXPECT_THAT(refusal(fisheye, CalibrationFormat::cahvor, "a.cahvor"),
              HasSubstr("cameras.left: .cahvor files do not support the model"));
  EXPECT_THAT(refusal(rational, CalibrationFormat::kalibr, "a.yaml"),
              HasSubstr("cameras.left: this format supports four"));
  EXPECT_THAT(refusal(rational, CalibrationFormat::tsai, "a.tsai"),
              HasSubstr("do not support the coefficients k4, k5, k6"));
  EXPECT_THAT(refusal(skewed, CalibrationFormat::mrcal, "a.cameramodel"),
              HasSubstr("cameras.left: mrcal does not support skew, this camera has 0.5 px: 0.64 px"));
  EXPECT_THAT(refusal(skewed, CalibrationFormat::ros, "a.yaml"), HasSubstr("cameras.left: ros does not support skew"));
  EXPECT_THAT(refusal(skewed, CalibrationFormat::opencv, "a.yml"),
              HasSubstr("cameras.left: opencv does not support skew"));
  EXPECT_THAT(refusal(skewed, CalibrationFormat::euroc, "a"), HasSubstr("cameras.left: euroc does not support skew"));
  EXPECT_EQ(refusal(skewed, CalibrationFormat::cahvor, "a.cahvor"), "nothing");

  left.model = right.model = pinhole;
  const Rig rotated = rig_of_one_pair("r", left, right, Pose(exp_so3({0, 0.01, 0}), {-0.1, 0, 0}));
  EXPECT_THAT(to_calibration_files(rotated, CalibrationFormat::kitti, "calib.txt").error().message(),
              HasSubstr("cameras.right: kitti supports rectified pairs only; relative to the left camera, this one is "
                        "rotated by 0.01 rad"));
  Rig three = rotated;
  three.cameras.push_back(left);
  three.cameras.back().name = "third";
  for (const auto format : {CalibrationFormat::ros, CalibrationFormat::opencv, CalibrationFormat::tsai}) {
    EXPECT_THAT(to_calibration_files(three, format, "x").error().message(), HasSubstr("cameras.third: "));
  }
  EXPECT_TRUE(to_calibration_files(three, CalibrationFormat::kalibr, "x.yaml"));
  EXPECT_EQ(to_calibration_files(three, CalibrationFormat::euroc, "x")->size(), 3u);
}

}  // namespace
}  // namespace spartan
