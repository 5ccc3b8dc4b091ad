// ZED: a file as the maker's, against cv::stereoRectify as the maker's program calls it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>

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
    "[LEFT_CAM_FHD]\nfx=1400.5\nfy=1400.25\ncx=961.5\ncy=530.75\nk1=-0.17\nk2=0.026\np1=0.0001\np2=-0.0002\nk3=1e-05\n\n"
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
  EXPECT_EQ(full->rig.cameras[0].model,
            CameraModel(RadialTangentialModel({1400.5, 1400.25, 961.5, 530.75}, {-0.17, 0.026, 0.0001, -0.0002, 1e-5})));
  EXPECT_EQ(half->rig.cameras[1].model, CameraModel(RadialTangentialModel({701, 700.5, 633, 359}, {-0.171, 0.027})));
  EXPECT_EQ(half->rig.cameras[1].size, ImageSize(1280, 720));
}

// x_right = R x_left + T is the geometry that the maker rectifies by: its T has the other sign, which rectifies alike.
TEST_F(ZedCalib, RectifiesAsTheMakersProgram) {
  const Rig rig = read(kZed).value().rig;
  const Pose right_from_left = rig.right_from_left(rig.pairs[0]);
  EXPECT_LE((right_from_left.translation() - Eigen::Vector3d(-0.1195, -0.00125, 0.0025)).norm(), 1e-15);
  const cv::Matx33d left(700.25, 0, 641.25, 0, 700.125, 344, 0, 0, 1), right(701, 0, 633, 0, 700.5, 359, 0, 0, 1);
  const cv::Vec4d left_k(-0.17, 0.026, 0, 0), right_k(-0.171, 0.027, 0, 0);
  cv::Mat rotation;
  cv::Rodrigues(cv::Vec3d(-0.004, 0.006, 0.0015), rotation);
  const auto rectify = [&](const cv::Mat& r, const cv::Vec3d& t) {
    std::array<cv::Mat, 5> out;
    cv::stereoRectify(left, left_k, right, right_k, {1280, 720}, r, t, out[0], out[1], out[2], out[3], out[4],
                      cv::CALIB_ZERO_DISPARITY, 0, {1280, 720});
    return out;
  };
  const auto makers = rectify(rotation, {119.5, 1.25, -2.5});
  cv::Mat own(3, 3, CV_64F);
  const Eigen::Matrix3d matrix = right_from_left.rotation_matrix();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) own.at<double>(row, column) = matrix(row, column);
  }
  const Eigen::Vector3d& t = right_from_left.translation();
  const auto ours = rectify(own, {t.x(), t.y(), t.z()});
  for (std::size_t i : {0U, 1U, 2U}) EXPECT_LE(cv::norm(makers[i], ours[i], cv::NORM_INF), 1e-9) << i;
  EXPECT_LT(ours[3].at<double>(0, 3), 0) << "the right camera is to the right";
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
  EXPECT_THAT(error_message(read(kCameras)), HasSubstr("the section [stereo] is missing"));
  EXPECT_THAT(message_for("[RIGHT_CAM_HD]", "[RIGHT_CAM_VGA]"), HasSubstr("the section [right_cam_hd] is missing"));
  EXPECT_THAT(message_for("Baseline=119.5", "Baseline=0.1195"), HasSubstr("SN8452.conf:40: baseline: must be in milli"));
  EXPECT_THAT(message_for("fx=700.25", "fx=-1"), HasSubstr("SN8452.conf:24: fx: the focal length must be above zero"));
  EXPECT_THAT(message_for("RX_HD", "RX_VGA"), HasSubstr("the line 'rx_hd=' is missing"));
  EXPECT_THAT(message_for("k2=0.026\n\n", "k2=0.026\nk4=0.1\n\n"), HasSubstr("k4: is of a fisheye lens"));
}

}  // namespace
}  // namespace spartan::internal
