// Kalibr: its documented examples and manually computed values.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/testing/first_pair.h"
#include "spartan/testing/temporary_folder.h"
#include "spartan/testing/text_checks.h"

namespace spartan::internal {
namespace {

using testing::error_message;
using ::testing::HasSubstr;
using testing::replaced;
using testing::right_in_left;
using testing::TemporaryFolder;

// The example of the project's wiki, with a third camera.
const std::string kCamchain = R"(cam0:
  camera_model: pinhole
  intrinsics: [461.629, 460.152, 362.680, 246.049]
  distortion_model: radtan
  distortion_coeffs: [-0.27695497, 0.06712482, 0.00087538, 0.00011556]
  rostopic: /cam0/image_raw
  resolution: [752, 480]
cam1:
  camera_model: omni
  intrinsics: [0.80065662, 833.006, 830.345, 373.850, 253.749]
  distortion_model: radtan
  distortion_coeffs: [0, 0, 0, 0]
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.002]
  - [0.0, 0.0, 1.0, 0.001]
  - [0.0, 0.0, 0.0, 1.0]
  resolution: [640, 400]
cam2:
  camera_model: ds
  intrinsics: [-0.2, 0.59, 317.5, 316.1, 724.8, 546.5]
  distortion_model: none
  distortion_coeffs: []
  T_cn_cnm1:
  - [0.0, 0.0, -1.0, 0.5]
  - [0.0, 1.0, 0.0, 0.0]
  - [1.0, 0.0, 0.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  resolution: [1440, 1080]
)";

TEST(KalibrCalib, ChainsTransforms) {
  const TemporaryFolder folder;
  const auto read = read_calibration(folder.write("camchain.yaml", kCamchain));
  ASSERT_TRUE(read) << read.error().message();
  const Rig& rig = read->rig;
  EXPECT_EQ(read->format, CalibrationFormat::kalibr);
  EXPECT_EQ(rig.convention, PoseConvention::left_optical);
  ASSERT_EQ(rig.cameras.size(), 3u);
  ASSERT_EQ(rig.pairs.size(), 1u);
  EXPECT_EQ(rig.pairs[0].right, "cam1");
  EXPECT_LE((right_in_left(rig) - Eigen::Vector3d(0.11, -0.002, -0.001)).norm(), 1e-15);
  // Camera 2 looks along x of camera 1: p2 = (0.5 − z, y, x) for p1 = (x, y, z), so its position in camera 1 is (0, 0,
  // 0.5).
  const Pose cam1_from_cam2 = rig.body_from_camera("cam1").inverse() * rig.body_from_camera("cam2");
  EXPECT_LE((cam1_from_cam2.translation() - Eigen::Vector3d(0, 0, 0.5)).norm(), 1e-15);
  EXPECT_LE((cam1_from_cam2.rotation() * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 1e-15);
  EXPECT_EQ(rig.cameras[0].model,
            CameraModel(RadialTangentialModel({461.629, 460.152, 362.680, 246.049},
                                              {-0.27695497, 0.06712482, 0.00087538, 0.00011556})));
  EXPECT_EQ(rig.cameras[1].model, CameraModel(DoubleSphereModel{{833.006, 830.345, 373.850, 253.749}, 0.80065662, 0}));
  EXPECT_EQ(rig.cameras[2].model, CameraModel(DoubleSphereModel{{317.5, 316.1, 724.8, 546.5}, -0.2, 0.59}));
  EXPECT_EQ(rig.cameras[2].size, (ImageSize{1440, 1080}));
}

TEST(KalibrCalib, WithImuTheBodyIsTheImu) {
  const TemporaryFolder folder;
  // The camera looks along the IMU's x: p_cam = (−y, −z, x) + t.
  const std::string imu =
      "  T_cam_imu:\n  - [0, -1, 0, 0.07]\n  - [0, 0, -1, -0.01]\n  - [1, 0, 0, 0.004]\n  - [0, 0, 0, 1]\n"
      "  timeshift_cam_imu: -8.121e-05\n";
  const auto read =
      read_calibration(folder.write("camchain-imucam.yaml", replaced(kCamchain, "  rostopic: /cam0/image_raw\n", imu)));
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->rig.convention, PoseConvention::body);
  const Pose body_from_camera = read->rig.body_from_camera("cam0");
  EXPECT_LE((body_from_camera.translation() - Eigen::Vector3d(-0.004, 0.07, -0.01)).norm(), 1e-15);
  EXPECT_LE((right_in_left(read->rig) - Eigen::Vector3d(0.11, -0.002, -0.001)).norm(), 1e-15);
  EXPECT_EQ(read->body, "the IMU of T_cam_imu");
  EXPECT_THAT(read->notes, ::testing::ElementsAre("body: the IMU of T_cam_imu"));
  EXPECT_TRUE(read->ignored.empty());
  EXPECT_EQ(read->rig.imu.time_offset_s, -8.121e-05);
  const std::string late =
      replaced(replaced(kCamchain, "  rostopic: /cam0/image_raw\n", imu), "  resolution: [640, 400]\n",
               "  timeshift_cam_imu: 0.01\n  resolution: [640, 400]\n");
  const auto two_clocks = read_calibration(folder.write("camchain.yaml", late));
  ASSERT_TRUE(two_clocks) << two_clocks.error().message();
  ASSERT_EQ(two_clocks->ignored.size(), 1u);
  EXPECT_EQ(two_clocks->ignored[0].key, "cam1.timeshift_cam_imu");
  const std::string other = replaced(imu, "0.07", "0.09");
  const std::string both = replaced(replaced(kCamchain, "  rostopic: /cam0/image_raw\n", imu),
                                    "  resolution: [640, 400]\n", other + "  resolution: [640, 400]\n");
  EXPECT_THAT(error_message(read_calibration(folder.write("camchain.yaml", both))),
              HasSubstr("is inconsistent with T_cn_cnm1"));
}

// The transform to the IMU may be given for any camera and in either direction (OpenVINS: T_imu_cam).
TEST(KalibrCalib, AnyCameraMayGiveTheImu) {
  const TemporaryFolder folder;
  const std::string cam_imu =
      "  T_cam_imu:\n  - [0, -1, 0, 0.07]\n  - [0, 0, -1, -0.01]\n  - [1, 0, 0, 0.004]\n  - [0, 0, 0, 1]\n";
  const std::string imu_cam =
      "  T_imu_cam:\n  - [0, 0, 1, -0.004]\n  - [-1, 0, 0, 0.07]\n  - [0, -1, 0, -0.01]\n  - [0, 0, 0, 1]\n";
  const auto with = [&](int camera, const std::string& text) {
    const std::string at = fmt::format("cam{}:\n", camera);
    return read_calibration(folder.write("camchain.yaml", replaced(kCamchain, at, at + text)));
  };
  const Eigen::Vector3d position(-0.004, 0.07, -0.01);
  for (const std::string& text : {cam_imu, imu_cam, cam_imu + imu_cam}) {
    for (const int camera : {0, 1, 2}) {
      const auto read = with(camera, text);
      ASSERT_TRUE(read) << read.error().message();
      const std::string name = fmt::format("cam{}", camera);
      EXPECT_LE((read->rig.body_from_camera(name).translation() - position).norm(), 1e-14) << name;
      EXPECT_LE(
          (read->rig.body_from_camera(name).rotation() * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(),
          1e-14)
          << name;
      EXPECT_LE((right_in_left(read->rig) - Eigen::Vector3d(0.11, -0.002, -0.001)).norm(), 1e-14);
      EXPECT_EQ(read->rig.convention, PoseConvention::body);
      EXPECT_EQ(read->body, text == imu_cam ? "the IMU of T_imu_cam" : "the IMU of T_cam_imu");
    }
  }
  EXPECT_THAT(error_message(with(1, cam_imu + replaced(imu_cam, "0.07", "0.09"))),
              HasSubstr("cam1.T_cam_imu: is inconsistent with T_imu_cam"));
}

// Both cameras relative to the IMU, without T_cn_cnm1.
TEST(KalibrCalib, ExtrinsicsMayComeFromTheImu) {
  const TemporaryFolder folder;
  std::string text = kCamchain.substr(0, kCamchain.find("cam2:"));
  const std::string link =
      text.substr(text.find("  T_cn_cnm1"), text.find("  resolution: [640") - text.find("  T_cn_cnm1"));
  const auto pose = [](double y) {
    return fmt::format("  T_imu_cam:\n  - [0, 0, 1, 0]\n  - [-1, 0, 0, {}]\n  - [0, -1, 0, 0]\n  - [0, 0, 0, 1]\n", y);
  };
  text = replaced(replaced(text, link, ""), "cam1:\n", "cam1:\n" + pose(-0.05));
  EXPECT_THAT(error_message(read_calibration(folder.write("camchain.yaml", text))),
              HasSubstr("cam1.T_cn_cnm1: is missing"));
  const auto read = read_calibration(folder.write("camchain.yaml", replaced(text, "cam0:\n", "cam0:\n" + pose(0.05))));
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_LE((right_in_left(read->rig) - Eigen::Vector3d(0.1, 0, 0)).norm(), 1e-15);
}

TEST(KalibrCalib, UnsupportedContentIsNamed) {
  const TemporaryFolder folder;
  const auto message_for = [&](const std::string& what, const std::string& with) {
    return error_message(read_calibration(folder.write("camchain.yaml", replaced(kCamchain, what, with))));
  };
  EXPECT_THAT(
      message_for("distortion_coeffs: [0, 0", "distortion_coeffs: [0.1, 0"),
      HasSubstr("camchain.yaml:12: cam1.distortion_coeffs: omni with an additional distortion is not supported"));
  EXPECT_THAT(message_for("model: radtan", "model: fov"),
              HasSubstr("camchain.yaml:4: cam0.distortion_model: is 'fov'"));
  EXPECT_THAT(message_for("camera_model: ds", "camera_model: eucm"),
              HasSubstr("cam2.intrinsics: eucm with beta = 0.59"));
  EXPECT_THAT(message_for("ds\n  intrinsics: [-0.2, 0.59", "eucm\n  intrinsics: [0.6, 1"), HasSubstr("nothing"));
  EXPECT_THAT(message_for("-0.2, 0.59", "-0.2, 1.59"), HasSubstr("alpha is 1.59"));
}

}  // namespace
}  // namespace spartan::internal
