// ZED: files as Stereolabs' programs write them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <string>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/rig/models/camera_model.h"
#include "spartan/testing/temporary_folder.h"
#include "spartan/testing/text_checks.h"

namespace spartan::internal {
namespace {

using testing::error_message;
using ::testing::HasSubstr;
using testing::replaced;
using testing::TemporaryFolder;

const std::string kCameras =
    "[LEFT_CAM_FHD]\nfx=1400.5\nfy=1400.25\ncx=961.5\ncy=530.75\nk1=-0.17\nk2=0.026\np1=0.0001\np2=-0.0002\nk3=1e-"
    "05\n\n"
    "[RIGHT_CAM_FHD]\nfx=1402\nfy=1401\ncx=950\ncy=541\nk1=-0.171\nk2=0.027\np1=0\np2=0\nk3=0\n\n"
    "[LEFT_CAM_HD]\nfx=700.25\nfy=700.125\ncx=641.25\ncy=344\nk1=-0.17\nk2=0.026\n\n"
    "[RIGHT_CAM_HD]\nfx=701\nfy=700.5\ncx=633\ncy=359\nk1=-0.171\nk2=0.027\n\n";
const std::string kStereo =
    "[STEREO]\nBaseline=119.5\nTY=1.25\nTZ=-2.5\nCV_FHD=0.011\nCV_HD=0.006\nRX_FHD=-0.0009\nRX_HD=-0.004\n"
    "RZ_FHD=0.0007\nRZ_HD=0.0015\n\n[MISC]\nSensor_ID=0\n";
const std::string kZed = kCameras + kStereo;

class ZedCalib : public ::testing::Test {
 protected:
  Result<LoadedRig> read(const std::string& text, ImageSize size = {1280, 720}) {
    return read_calibration(folder_.write("SN8452.conf", text), size);
  }
  TemporaryFolder folder_;
};

TEST_F(ZedCalib, CamerasAreThoseOfTheImageSize) {
  const auto full = read(kZed, {1920, 1080}), half = read(kZed);
  ASSERT_TRUE(full) << full.error().message();
  ASSERT_TRUE(half) << half.error().message();
  EXPECT_EQ(full->format, CalibrationFormat::zed);
  EXPECT_EQ(full->rig.cameras[0].model, CameraModel(RadialTangentialModel({1400.5, 1400.25, 961.5, 530.75},
                                                                          {-0.17, 0.026, 0.0001, -0.0002, 1e-5})));
  EXPECT_EQ(half->rig.cameras[1].model, CameraModel(RadialTangentialModel({701, 700.5, 633, 359}, {-0.171, 0.027})));
  EXPECT_EQ(half->rig.cameras[1].size, ImageSize(1280, 720));
}

// As zed-opencv-calibration writes it: Baseline = −T(0), TY = T(1), TZ = T(2), Rodrigues(R) = (RX, CV, RZ).
TEST_F(ZedCalib, GeometryIsThatOfOpenCvWithANegativeBaseline) {
  const Rig rig = read(kZed).value().rig;
  const Pose right_from_left = rig.right_from_left(rig.pairs[0]);
  EXPECT_LE((right_from_left.translation() - Eigen::Vector3d(-0.1195, 0.00125, -0.0025)).norm(), 1e-15);
  cv::Matx33d rotation;
  cv::Rodrigues(cv::Vec3d(-0.004, 0.006, 0.0015), rotation);
  const Eigen::Matrix3d matrix = right_from_left.rotation_matrix();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) EXPECT_NEAR(matrix(row, column), rotation(row, column), 1e-12);
  }
}

TEST_F(ZedCalib, OldFilesHaveNoOffsetsAndNewOnesThoseOfAResolution) {
  const auto right_at = [&](const std::string& text) {
    const Rig rig = read(text).value().rig;
    return rig.right_from_left(rig.pairs[0]).translation();
  };
  const std::string old = replaced(replaced(kZed, "TY=1.25\n", ""), "TZ=-2.5\n", "");
  EXPECT_LE((right_at(old) - Eigen::Vector3d(-0.1195, 0, 0)).norm(), 1e-15);
  EXPECT_LE((right_at(replaced(kZed, "TY=1.25\n", "TY=1.25\nTY_HD=1.5\n")) - Eigen::Vector3d(-0.1195, 0.0015, -0.0025))
                .norm(),
            1e-15);
}

TEST_F(ZedCalib, SectionsOfDistortionHoldForAllResolutions) {
  const std::string rational =
      kZed + "\n [LEFT_DISTO]\nk1 = 1\nk2 = 2\np1 = 3\np2 = 4\nk3 = 5\nk4 = 6\nk5 = 7\nk6 = 8\n";
  const auto read_rational = read(rational);
  ASSERT_TRUE(read_rational) << read_rational.error().message();
  EXPECT_EQ(read_rational->rig.cameras[0].model,
            CameraModel(RadialTangentialModel({700.25, 700.125, 641.25, 344}, {1, 2, 3, 4, 5, 6, 7, 8})));
  EXPECT_EQ(read_rational->rig.cameras[1].model,
            CameraModel(RadialTangentialModel({701, 700.5, 633, 359}, {-0.171, 0.027})));
  const std::string fisheye = kZed + "\n[LEFT_DISTO]\nk1=0.1\nk2=0.2\nk3=0.03\nk4=0.04\nk5=0\nk6=0\np1=0\np2=0\n";
  EXPECT_EQ(read(fisheye).value().rig.cameras[0].model,
            CameraModel(EquidistantModel({700.25, 700.125, 641.25, 344}, {0.1, 0.2, 0.03, 0.04})));
}

TEST_F(ZedCalib, AFolderIsItsFile) {
  folder_.write("SN8452.conf", kZed);
  folder_.write("other.conf", "[server]\nport=80\n");
  const auto rig = read_calibration(folder_.path(), {1280, 720});
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->format, CalibrationFormat::zed);
  EXPECT_THAT(error_message(read_calibration(folder_.path() + "/other.conf")), HasSubstr("of a known format"));
  EXPECT_THAT(error_message(read_zed_calib(folder_.path() + "/other.conf")), HasSubstr("no section as [LEFT_CAM_HD]"));
}

TEST_F(ZedCalib, AFileOfOneSizeNeedsNoImages) {
  const std::string one = kZed.substr(0, kZed.find("[LEFT_CAM_HD]")) + kStereo;
  const auto rig = read(one, {});
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->rig.cameras[0].size, ImageSize(1920, 1080));
  const auto unknown = read_zed_calib(folder_.write("SN1.conf", kZed));
  EXPECT_THAT(error_message(unknown), HasSubstr("several image sizes: 1920x1080, 1280x720"));
}

TEST_F(ZedCalib, LinesMayEndAsInWindows) {
  std::string text;
  for (const char c : kZed) text += c == '\n' ? "\r\n" : std::string(1, c);
  EXPECT_EQ(error_message(read(text)), "nothing");
}

TEST_F(ZedCalib, ErrorsAreSpecific) {
  const auto message_for = [&](const std::string& what, const std::string& with) {
    return error_message(read(replaced(kZed, what, with)));
  };
  EXPECT_THAT(error_message(read(kZed, {640, 480})), HasSubstr("has no cameras of 640x480 pixels, but of 1920x1080, "));
  EXPECT_THAT(error_message(read(kCameras)), HasSubstr("the section [STEREO] is missing"));
  EXPECT_THAT(message_for("[RIGHT_CAM_HD]", "[RIGHT_CAM_VGA]"), HasSubstr("the section [RIGHT_CAM_HD] is missing"));
  EXPECT_THAT(message_for("[MISC]", "[left_cam_hd]"),
              HasSubstr("SN8452.conf:50: the section [LEFT_CAM_HD] is there twice"));
  EXPECT_THAT(message_for("Baseline=119.5", "Baseline=0.1195"),
              HasSubstr("SN8452.conf:40: baseline: must be in milli"));
  EXPECT_THAT(message_for("TZ=-2.5", "TZ=-25000"), HasSubstr("SN8452.conf:42: tz: must be in millimetres"));
  EXPECT_THAT(message_for("RX_HD=-0.004", "RX_HD=1.2"), HasSubstr("rx_hd: with CV and RZ must be a rotation vector"));
  EXPECT_THAT(message_for("RX_HD", "RX_VGA"), HasSubstr("the line 'rx_hd=' is missing"));
  EXPECT_THAT(message_for("CV_HD", "RX_HD"), HasSubstr("more than once"));
  EXPECT_THAT(message_for("fx=700.25", "fx=-1"), HasSubstr("SN8452.conf:24: fx: the focal length must be above zero"));
  EXPECT_THAT(message_for("fx=700.25", "fx=nan"), HasSubstr("SN8452.conf:24"));
  EXPECT_THAT(message_for("fx=700.25", "fx=1e300"), HasSubstr("SN8452.conf"));
}

}  // namespace
}  // namespace spartan::internal
