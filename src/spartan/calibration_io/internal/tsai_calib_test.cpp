// Ames Stereo Pipeline: a file from its distribution and manually computed values.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/testing/temporary_folder.h"
#include "spartan/testing/text_checks.h"

namespace spartan::internal {
namespace {

using testing::error_message;
using ::testing::HasSubstr;
using testing::replaced;
using testing::TemporaryFolder;

// The left camera of the K10 rover from the distribution of the Ames Stereo Pipeline (Apache-2.0).
const std::string kTsai =
    "fu = 620.857971191406\nfv = 622.298034667969\ncu = 526.128784179688\ncv = 374.273742675781\n"
    "u_direction = 1 0 0\nv_direction = 0 1 0\nw_direction = 0 0 1\nC = 0.0751 -0.065 -0.902\n"
    "R = 0.000794376506820371 -0.371711462117335 0.928347972420126 0.997550683961614 -0.0646367856775087 "
    "-0.0267342264708707 0.0699428473375328 0.92609539188351 0.370749677327501\n"
    "k1 = -0.331998556852341\nk2 = 0.125557452440262\np1 = -0.000432605884270742\np2 = 0.00110327918082476\n";

class TsaiCalib : public ::testing::Test {
 protected:
  Result<LoadedRig> read(const std::string& left, ImageSize size = {1024, 768}) {
    // The right camera is 10 cm to the right of the left one.
    folder_.write("k_right.tsai", replaced(kTsai, "-0.065", "0.035"));
    return read_calibration(folder_.write("k_left.tsai", left), size);
  }
  TemporaryFolder folder_;
};

TEST_F(TsaiCalib, AForwardRightDownFrameIsConverted) {
  const auto k10 = read(kTsai);
  ASSERT_TRUE(k10) << k10.error().message();
  EXPECT_EQ(k10->rig.convention, PoseConvention::body);
  const Pose left = k10->rig.body_from_camera("left");
  EXPECT_LE((left.translation() - Eigen::Vector3d(0.0751, 0.065, 0.902)).norm(), 1e-15);
  EXPECT_LE((left.rotation() * Eigen::Vector3d::UnitZ() -
             Eigen::Vector3d(0.928347972420126, 0.0267342264708707, -0.370749677327501))
                .norm(),
            1e-9);
  EXPECT_LE((k10->rig.body_from_camera("right").translation() - Eigen::Vector3d(0.0751, -0.035, 0.902)).norm(), 1e-15);
  EXPECT_THAT(k10->notes.at(0), HasSubstr("forward-right-down"));
}

TEST_F(TsaiCalib, DistortionAndPitchAreThoseOfTheStereoPipeline) {
  const auto model = [&](const std::string& text) { return read(text).value().rig.cameras[0].model; };
  const CameraModel plain = model(kTsai);
  EXPECT_EQ(plain, CameraModel(RadialTangentialModel(
                       {620.857971191406, 622.298034667969, 526.128784179688, 374.273742675781},
                       {-0.331998556852341, 0.125557452440262, -0.000432605884270742, 0.00110327918082476})));
  const std::string version3 = "VERSION_3\n" + replaced(kTsai, "k1 =", "pitch = 1\nTSAI\nk1 =");
  EXPECT_EQ(model(version3), plain);
  const std::string version4 = "VERSION_4\nPINHOLE\n" + replaced(kTsai, "k1 =", "pitch = 2\nTSAI\nk1 =") + "k3 = 0.5\n";
  EXPECT_EQ(parameters(model(version4))[0][0], 620.857971191406 / 2);
  EXPECT_EQ(parameters(model(version4))[1][1], 374.273742675781 / 2);
  EXPECT_EQ(parameters(model(version4))[2][4], 0.5);
  EXPECT_EQ(name_of(model("VERSION_4\nPINHOLE\n" + kTsai.substr(0, kTsai.find("k1")) + "pitch = 1\nNULL\n")),
            "pinhole");
  // Image axes that differ from the camera axes: u along the camera's y, v along its −x.
  const std::string turned = replaced(replaced(kTsai, "u_direction = 1 0 0", "u_direction = 0 1 0"),
                                      "v_direction = 0 1 0", "v_direction = -1 0 0");
  const auto right_from_left = [&](const std::string& text) {
    const Rig rig = read(text)->rig;
    return rig.right_from_left(rig.pairs[0]);
  };
  const Pose straight = right_from_left(kTsai), lying = right_from_left(turned);
  EXPECT_LE((lying * Eigen::Vector3d(1, 0, 2) - straight * Eigen::Vector3d(0, 1, 2)).norm(), 1e-9);
  EXPECT_LE((lying * Eigen::Vector3d(0, 1, 2) - straight * Eigen::Vector3d(-1, 0, 2)).norm(), 1e-9);
}

TEST_F(TsaiCalib, CommentsMayFollowNumbers) {
  EXPECT_EQ(error_message(read(replaced(kTsai, "C = 0.0751 -0.065 -0.902", "C = 0.0751 -0.065 -0.902 # centre"))),
            "nothing");
}

TEST_F(TsaiCalib, ErrorsAreSpecific) {
  const auto message_for = [&](const std::string& what, const std::string& with) {
    return error_message(read(replaced(kTsai, what, with)));
  };
  for (const char* kind : {"AdjustableTSAI", "BrownConrady", "Photometrix", "RPC"}) {
    EXPECT_THAT(error_message(read("VERSION_4\nPINHOLE\n" +
                                   replaced(kTsai, "k1 =", std::string("pitch = 1\n") + kind + "\nk1 ="))),
                HasSubstr(fmt::format("k_left.tsai:13: '{}' is not supported", kind)));
  }
  EXPECT_THAT(message_for("R = 0.0007", "R = 0.7"), HasSubstr("k_left.tsai:9: R: is not a rotation matrix"));
  EXPECT_THAT(message_for("u_direction = 1", "u_direction = 2"),
              HasSubstr("k_left.tsai:5: u_direction: with v_direction"));
  EXPECT_THAT(message_for("k2 = 0.1", "k9 = 0.1"), HasSubstr("k_left.tsai: the line 'k2=' is missing"));
  EXPECT_THAT(message_for("fu = 620", "fu = -620"),
              HasSubstr("k_left.tsai:1: fu: the focal length must be above zero"));
  EXPECT_THAT(error_message(read(kTsai, {})), HasSubstr("image size is not known"));
}

}  // namespace
}  // namespace spartan::internal
