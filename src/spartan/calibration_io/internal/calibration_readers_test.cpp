// Readers of KITTI, KITTI raw, EuRoC and OpenCV calibrations.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <opencv2/core/persistence.hpp>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/testing/first_pair.h"
#include "spartan/testing/real_data.h"
#include "spartan/testing/temporary_folder.h"
#include "spartan/testing/text_checks.h"

namespace spartan::internal {
namespace {

using testing::error_message;
using ::testing::HasSubstr;
using testing::replaced;
using testing::right_in_left;
using testing::TemporaryFolder;

// --- KITTI odometry ---

const std::string kKitti =
    "P0: 700 0 600 0 0 700 180 0 0 0 1 0\n"
    "P1: 700 0 600 -378 0 700 180 0 0 0 1 0\n"
    "P2: 700 0 600 45 0 700 180 -0.3 0 0 1 0.005\n";

TEST(KittiCalib, BaselineIsInTheLastColumn) {
  const TemporaryFolder folder;
  const auto rig = read_kitti_calib(folder.write("calib.txt", kKitti), {1240, 376});
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->convention, PoseConvention::left_optical);
  EXPECT_EQ(rig->cameras[0].model, CameraModel(PinholeModel{700, 700, 600, 180}));
  EXPECT_EQ(rig->cameras[0].size, (ImageSize{1240, 376}));
  EXPECT_LE((right_in_left(*rig) - Eigen::Vector3d(0.54, 0, 0)).norm(), 1e-12);
}

TEST(KittiCalib, ErrorsAreSpecific) {
  const TemporaryFolder folder;
  const auto message_for = [&](const std::string& what, const std::string& with, ImageSize size = {1240, 376}) {
    return error_message(read_kitti_calib(folder.write("calib.txt", replaced(kKitti, what, with)), size));
  };
  EXPECT_THAT(message_for("P1:", "Q1:"), HasSubstr("P1"));
  EXPECT_THAT(message_for("P0: 700", "P0: nan"), HasSubstr("calib.txt:1"));
  EXPECT_THAT(message_for("P0: 700", "P0: inf"), HasSubstr("calib.txt:1"));
  EXPECT_THAT(message_for("P0: 700", "P0:"), HasSubstr("calib.txt:1"));
  EXPECT_THAT(message_for("P0: 700", "P0: 0"), HasSubstr("above zero"));
  EXPECT_THAT(message_for("P0: 700", "P0: seven"), HasSubstr("calib.txt:1"));
  EXPECT_THAT(message_for("-378", "378"), HasSubstr("baseline of -0.54"));
  EXPECT_THAT(message_for("-378 0 700 180", "-378 0 700 190"), HasSubstr("does not have the rows of P0"));
  EXPECT_THAT(message_for("P0", "P0", ImageSize{}), HasSubstr("image size is not known"));
  EXPECT_THAT(error_message(read_kitti_calib(folder.path() + "/none.txt", {1240, 376})), HasSubstr("none.txt"));
  EXPECT_THAT(error_message(read_kitti_calib(folder.write("empty.txt", ""), {1240, 376})), HasSubstr("empty.txt"));
}

// A NaN anywhere makes the file invalid; other cameras are ignored, which is reported.
TEST(KittiCalib, OtherCamerasAreIgnoredButChecked) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& what, const std::string& with) {
    return read_calibration(folder.write("calib.txt", replaced(kKitti, what, with) + "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n"),
                            {1240, 376});
  };
  EXPECT_THAT(error_message(read("P2: 700", "P2: nan")), HasSubstr("calib.txt:3: P2: 'nan' is not a finite number"));
  EXPECT_THAT(error_message(read("P2: 700", "Tr: nan")), HasSubstr("calib.txt:3: Tr"));
  EXPECT_THAT(error_message(read("P2: 700", "P3: 1 700")), HasSubstr("calib.txt:3: P3: has 13 numbers, must have 12"));
  const auto ignored_of = [](const Result<LoadedRig>& of) {
    std::string all;
    for (const RigDifference& each : of.value().ignored) all += each.key + ": " + each.text + "\n";
    return all;
  };
  EXPECT_EQ(ignored_of(read("P0", "P0")),
            "P2: a colour camera, which is not read\nTr: the place of the laser scanner, which is not read\n");
  EXPECT_THAT(ignored_of(read("-378 0 700 180 0 0 0 1 0", "-378 0 700 180 0.5 0 0 1 0.0009")),
              HasSubstr("P1: the last numbers of its rows 2 and 3, 0.5 and 0.0009, are set to 0"));
}

// --- KITTI raw ---

const std::string kRaw =
    "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.950000e-02\n"
    "S_rect_00: 1242 375\nR_rect_00: 1 0 0 0 1 0 0 0 1\nP_rect_00: 721 0 609 0 0 721 172 0 0 0 1 0\n"
    "S_rect_01: 1242 375\nP_rect_01: 721 0 609 -387.377 0 721 172 0 0 0 1 0\n";
// Body (IMU) x ahead, y left, z up; camera z ahead, x right, y down.
const std::string kImuToVelo = "R: 1 0 0 0 1 0 0 0 1\nT: -0.8 0.3 -0.8\n";
const std::string kVeloToCam = "R: 0 -1 0 0 0 -1 1 0 0\nT: 0 -0.07 -0.27\n";

TEST(KittiRawCalib, WithoutImuTheBodyIsTheLeftCamera) {
  const TemporaryFolder folder;
  const auto rig = read_kitti_raw_calib(folder.write("calib_cam_to_cam.txt", kRaw));
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->convention, PoseConvention::left_optical);
  EXPECT_EQ(rig->cameras[0].size, (ImageSize{1242, 375}));
  EXPECT_NEAR(right_in_left(*rig).x(), 387.377 / 721, 1e-12);
}

TEST(KittiRawCalib, WithImuTheBodyIsTheImu) {
  const TemporaryFolder folder;
  folder.write("calib_imu_to_velo.txt", kImuToVelo);
  folder.write("calib_velo_to_cam.txt", kVeloToCam);
  const auto rig = read_kitti_raw_calib(folder.write("calib_cam_to_cam.txt", kRaw));
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->convention, PoseConvention::body);
  // p_cam = R (p_imu + t_iv) + t_vc = 0 → p_imu = −Rᵀ t_vc − t_iv
  const Pose body_from_left = rig->body_from_camera("cam0");
  EXPECT_LE((body_from_left.translation() - Eigen::Vector3d(0.27 + 0.8, -0.3, 0.8 - 0.07)).norm(), 1e-12);
  EXPECT_LE((body_from_left.rotation() * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_NEAR(right_in_left(*rig).x(), 387.377 / 721, 1e-12);
}

TEST(KittiRawCalib, UnrectifiedCamerasAreIgnored) {
  const TemporaryFolder folder;
  const auto keys = [&](const std::string& more) {
    std::string all;
    const LoadedRig read = read_calibration(folder.write("calib_cam_to_cam.txt", kRaw + more)).value();
    for (const RigDifference& each : read.ignored) all += each.key + ";";
    return all;
  };
  EXPECT_EQ(keys(""), "");
  EXPECT_EQ(keys("K_00: 721 0 609 0 721 172 0 0 1\nD_00: 0 0 0 0 0\n"), "") << "it equals the rectified camera";
  EXPECT_EQ(keys("K_00: 721 0 609 0 721 172 0 0 1\nD_00: 0.1 0 0 0 0\n"), "K_00;");
  EXPECT_EQ(keys("K_01: 720 0 609 0 721 172 0 0 1\nD_01: 0 0 0 0 0\nP_rect_02: 1 0 0 0 0 1 0 0 0 0 1 0\n"),
            "P_rect_02;K_01;");
}

TEST(KittiRawCalib, ErrorsAreSpecific) {
  const TemporaryFolder folder;
  const auto message_for = [&](const std::string& what, const std::string& with) {
    return error_message(read_kitti_raw_calib(folder.write("calib_cam_to_cam.txt", replaced(kRaw, what, with))));
  };
  EXPECT_THAT(message_for("S_rect_00: 1242 375", "S_rect_00: 1242"), HasSubstr("calib_cam_to_cam.txt:3"));
  EXPECT_THAT(message_for("S_rect_00: 1242 375", "S_rect_00: 1242.5 375"),
              HasSubstr("S_rect_00: must be two whole numbers"));
  EXPECT_THAT(message_for("S_rect_00: 1242 375", "S_rect_00: 1242 -375"), HasSubstr("S_rect_00"));
  folder.write("calib_velo_to_cam.txt", kVeloToCam);
  folder.write("calib_imu_to_velo.txt", replaced(kImuToVelo, "R: 1", "R: 2"));
  EXPECT_THAT(error_message(read_kitti_raw_calib(folder.write("calib_cam_to_cam.txt", kRaw))),
              HasSubstr("calib_imu_to_velo.txt:1: R: is not a rotation matrix"));
}

// --- EuRoC ---

const std::string kEuroc = R"(# General sensor definitions.
sensor_type: camera
comment: VI-Sensor cam0
T_BS:
  cols: 4
  rows: 4
  data: [0, 0, 1, 0.1,
         -1, 0, 0, 0.055,
         0, -1, 0, 0,
         0, 0, 0, 1]
rate_hz: 20
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458, 457, 367, 248]
distortion_model: radial-tangential
distortion_coefficients: [-0.28, 0.07, 0.0001, 0.00002]
)";

class EurocCalib : public ::testing::Test {
 protected:
  Result<Rig> read(const std::string& left, const std::string& right) {
    folder_.write("mav0/cam0/sensor.yaml", left);
    folder_.write("mav0/cam1/sensor.yaml", right);
    return read_euroc_calib(folder_.path() + "/mav0");
  }
  const std::string right_ = replaced(kEuroc, "0.055", "-0.055");
  TemporaryFolder folder_;
};

TEST_F(EurocCalib, BodyIsTheOneOfTheFiles) {
  const auto rig = read(kEuroc, right_);
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->convention, PoseConvention::body);
  EXPECT_LE((right_in_left(*rig) - Eigen::Vector3d(0.11, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(parameters(rig->cameras[0].model)[2], (std::vector<double>{-0.28, 0.07, 0.0001, 0.00002}));
  EXPECT_EQ(rig->cameras[1].size, (ImageSize{752, 480}));
  EXPECT_TRUE(read("%YAML:1.0\n" + kEuroc, right_)) << "first line of OpenCV";
}

TEST_F(EurocCalib, ErrorsAreSpecific) {
  const auto message_for = [&](const std::string& what, const std::string& with) {
    return error_message(read(replaced(kEuroc, what, with), right_));
  };
  EXPECT_THAT(message_for("intrinsics: [458, ", "intrinsics: [.nan, "), HasSubstr("cam0/sensor.yaml:14: intrinsics"));
  EXPECT_THAT(message_for("intrinsics: [458, ", "intrinsics: ["), HasSubstr("must be a list of 4 numbers"));
  EXPECT_THAT(message_for("intrinsics: [458, ", "intrinsics: [0, "), HasSubstr("above zero"));
  EXPECT_THAT(message_for("camera_model: pinhole", "camera_model: fov"), HasSubstr("sensor.yaml:13: camera_model"));
  EXPECT_THAT(message_for("radial-tangential", "fov"), HasSubstr("sensor.yaml:15: distortion_model"));
  EXPECT_THAT(message_for("data: [0, 0, 1, 0.1", "data: [0, 0, 2, 0.1"), HasSubstr("T_BS: is not a rigid transform"));
  EXPECT_THAT(message_for("resolution: [752, 480]", "resolution: [752, 0]"), HasSubstr("sensor.yaml:12: resolution"));
  EXPECT_THAT(message_for("T_BS:", "T_SB:"), HasSubstr("T_BS"));
  EXPECT_THAT(error_message(read(kEuroc, kEuroc)), HasSubstr("baseline is zero"));
  const std::string both = error_message(read(replaced(kEuroc, "752", "x"), replaced(right_, "752", "y")));
  EXPECT_THAT(both, HasSubstr("cam0"));
  EXPECT_THAT(both, HasSubstr("cam1"));
  std::filesystem::remove(folder_.path() + "/mav0/cam1/sensor.yaml");
  EXPECT_THAT(error_message(read_euroc_calib(folder_.path() + "/mav0")), HasSubstr("cam1/sensor.yaml"));
}

// --- OpenCV ---

// A file as written by the calibration samples of OpenCV.
std::string opencv_yml(double tx, const cv::Mat& distortion = (cv::Mat_<double>(1, 5) << -0.2, 0.1, 0.001, 0, 0.02),
                       const char* name = "memory.yml") {
  cv::FileStorage file(name, cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  const cv::Mat k = (cv::Mat_<double>(3, 3) << 530, 0, 340, 0, 531, 235, 0, 0, 1);
  file << "M1" << k << "D1" << distortion << "M2" << k << "D2" << distortion << "R" << cv::Mat::eye(3, 3, CV_64F) << "T"
       << (cv::Mat_<double>(3, 1) << tx, 0, 0);
  return file.releaseAndGetString();
}

TEST(OpencvCalib, TIsTheTranslationOfRightFromLeft) {
  const TemporaryFolder folder;
  const auto rig = read_opencv_calib(folder.write("stereo.yml", opencv_yml(-0.12)), "", {640, 480});
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_LE((right_in_left(*rig) - Eigen::Vector3d(0.12, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(parameters(rig->cameras[0].model)[0], (std::vector<double>{530, 531}));
  EXPECT_EQ(parameters(rig->cameras[0].model)[1], (std::vector<double>{340, 235}));
  EXPECT_EQ(parameters(rig->cameras[0].model)[2], (std::vector<double>{-0.2, 0.1, 0.001, 0, 0.02}));
}

TEST(OpencvCalib, ReadsXml) {
  const TemporaryFolder folder;
  const cv::Mat distortion = (cv::Mat_<double>(1, 4) << -0.2, 0.1, 0, 0);
  const auto rig = read_rig(folder.write("stereo.xml", opencv_yml(-0.12, distortion, "memory.xml")), {640, 480});
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(parameters(rig->cameras[1].model)[2], (std::vector<double>{-0.2, 0.1, 0, 0}));
}

TEST(OpencvCalib, AMatrixWithTooManyRowsIsRejected) {
  const TemporaryFolder folder;
  const std::string text = replaced(opencv_yml(-0.12), "rows: 3", "rows: 200000000");
  EXPECT_THAT(error_message(read_opencv_calib(folder.write("stereo.yml", text), "", {640, 480})),
              HasSubstr("M1: does not have rows × cols numbers"));
}

TEST(OpencvCalib, TheSizeInTheFileHasPrecedence) {
  const TemporaryFolder folder;
  const std::string with_size = opencv_yml(-0.12) + "image_width: 800\nimage_height: 600\n";
  const auto rig = read_opencv_calib(folder.write("stereo.yml", with_size), "", {640, 480});
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->cameras[0].size, (ImageSize{800, 600}));
}

TEST(OpencvCalib, ErrorsAreSpecific) {
  const TemporaryFolder folder;
  const auto message_for = [&](const std::string& text, ImageSize size = {640, 480}) {
    return error_message(read_opencv_calib(folder.write("stereo.yml", text), "", size));
  };
  EXPECT_THAT(message_for(replaced(opencv_yml(-0.12), "M2", "N2")), HasSubstr("M2"));
  EXPECT_THAT(message_for(replaced(opencv_yml(-0.12), "530.", ".Nan")),
              HasSubstr("stereo.yml:3: M1: '.Nan' is not a finite number"));
  EXPECT_THAT(message_for(opencv_yml(0)), HasSubstr("stereo.yml"));
  EXPECT_THAT(message_for(opencv_yml(-0.12, cv::Mat_<double>::zeros(1, 3))),
              HasSubstr("D1: has 3 numbers, must have 4 or 5 or 8"));
  EXPECT_THAT(message_for(opencv_yml(-0.12), {}), HasSubstr("image size is not known"));
  EXPECT_THAT(message_for(opencv_yml(-0.12).substr(0, 300)), HasSubstr("stereo.yml"));
  EXPECT_THAT(message_for("no yaml at all: ["), HasSubstr("stereo.yml"));
}

// --- detection of the format ---

TEST(LoadedRig, DetectsTheFormatFromTheContent) {
  const TemporaryFolder folder;
  EXPECT_EQ(read_rig(folder.write("a/x.txt", kKitti), {1240, 376}).value().name, "kitti");
  EXPECT_EQ(read_rig(folder.write("b/x.txt", kRaw)).value().name, "kitti_raw");
  EXPECT_EQ(read_rig(folder.write("c/x.yml", opencv_yml(-0.1)), {640, 480}).value().name, "opencv");
  folder.write("mav0/cam1/sensor.yaml", replaced(kEuroc, "0.055", "-0.055"));
  EXPECT_EQ(read_rig(folder.write("mav0/cam0/sensor.yaml", kEuroc)).value().name, "euroc");
  EXPECT_EQ(read_rig(folder.path()).value().name, "euroc");
  EXPECT_EQ(read_rig(testing::source_folder() + "/config/rigs/rover.yaml").value().name, "rover");
  EXPECT_THAT(error_message(read_rig(folder.write("poem.txt", "roses are red"))), HasSubstr("poem.txt"));
  EXPECT_THAT(error_message(read_rig(folder.path() + "/a")), HasSubstr("contains no calibration"));
  EXPECT_THAT(error_message(read_rig(folder.path() + "/none")), HasSubstr("/none"));
}

// Independent of the file name.
TEST(CalibrationFormats, AreDetectedFromTheText) {
  using Format = CalibrationFormat;
  EXPECT_EQ(detect_calibration_format("x.txt", "{\n  'lensmodel': 'LENSMODEL_PINHOLE',\n}\n"), Format::mrcal);
  EXPECT_EQ(detect_calibration_format("x.txt", "VERSION_4\nPINHOLE\nfu = 1\nu_direction = 1 0 0\n"), Format::tsai);
  EXPECT_EQ(detect_calibration_format("x.txt", "Model = CAHV = perspective, linear\nDimensions = 640 480\n"),
            Format::cahvor);
  EXPECT_EQ(detect_calibration_format("x.txt", "roses are red\n"), std::nullopt);
}

TEST(CalibrationFormats, AreSelectedByFileNamesForWriting) {
  using Format = CalibrationFormat;
  const std::pair<const char*, Format> known[] = {{"a.cahv", Format::cahvor},
                                                  {"a.cahvore", Format::cahvor},
                                                  {"a.tsai", Format::tsai},
                                                  {"l.tsai,r.tsai", Format::tsai},
                                                  {"a.cameramodel", Format::mrcal},
                                                  {"a.xml", Format::opencv},
                                                  {"a.yml", Format::opencv},
                                                  {"l.yaml,r.yaml", Format::ros},
                                                  {"left_camera_info.yaml", Format::ros},
                                                  {"my_camchain.yaml", Format::kalibr},
                                                  {"a/calib.txt", Format::kitti},
                                                  {"a/calib_cam_to_cam.txt", Format::kitti_raw},
                                                  {"a/mav0", Format::euroc},
                                                  {"a.yaml", Format::rig_yaml}};
  for (const auto& [name, format] : known) EXPECT_EQ(calibration_format_for_path(name).value(), format) << name;
  EXPECT_EQ(calibration_format_for_path("a.odd").error().code, ErrorCode::usage);
}

TEST(LoadedRig, IgnoresAByteOrderMark) {
  const TemporaryFolder folder;
  EXPECT_EQ(error_message(read_calibration(folder.write("calib.txt", "\xEF\xBB\xBF" + kKitti), {1240, 376})),
            "nothing");
  EXPECT_EQ(error_message(read_calibration(folder.write("s.yml", "\xEF\xBB\xBF" + opencv_yml(-0.1)), {640, 480})),
            "nothing");
}

// A calibration is read more than once, which a pipe does not allow.
TEST(LoadedRig, RejectsPipes) {
  const TemporaryFolder folder;
  const std::string pipe = folder.path() + "/pipe.yaml";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THAT(error_message(read_calibration(pipe)), HasSubstr("pipe.yaml: is not a regular file"));
  EXPECT_THAT(error_message(read_rig_yaml(pipe)), HasSubstr("pipe.yaml: is not a regular file"));
}

TEST(LoadedRig, AFolderIsReadIfItContainsOneCalibration) {
  const TemporaryFolder folder;
  const auto name = [&](const std::string& path) {
    return read_rig(folder.path() + "/" + path, {640, 480}).value().name;
  };
  folder.write("yml/settings.yml", "%YAML:1.0\n---\nthreshold: 3\n");
  folder.write("yml/anything.yml", opencv_yml(-0.1));
  EXPECT_EQ(name("yml"), "opencv");
  folder.write("xml/stereo.xml", opencv_yml(-0.1, (cv::Mat_<double>(1, 4) << 0, 0, 0, 0), "memory.xml"));
  folder.write("xml/other.xml", "<settings/>");
  EXPECT_EQ(name("xml"), "opencv");
  folder.write("two/a.yml", opencv_yml(-0.1));
  folder.write("two/b.yml", opencv_yml(-0.2));
  EXPECT_THAT(error_message(read_rig(folder.path() + "/two")), HasSubstr("contains more than one calibration"));
}

TEST(LoadedRig, RealCalibrations) {
  const std::string data = testing::data_folder();
  if (!std::filesystem::exists(data + "/kitti_06"))
    GTEST_SKIP() << "no real recordings; SPARTAN_DATA says where they are";
  const struct {
    const char* path;
    double baseline_m;
  } known[] = {{"kitti_06", 0.53715}, {"rover_sandbox", 0.070}, {"euroc_v101", 0.11007}};
  for (const auto& [path, baseline_m] : known) {
    const auto rig = read_rig(data + "/" + path);
    ASSERT_TRUE(rig) << rig.error().message();
    EXPECT_NEAR(right_in_left(*rig).norm(), baseline_m, 1e-4) << path;
  }
}

}  // namespace
}  // namespace spartan::internal
