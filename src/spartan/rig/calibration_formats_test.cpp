// What each format says, against its documentation, files that its own tools wrote, and values by hand.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/core/persistence.hpp>

#include "spartan/rig/model_equivalents.h"
#include "spartan/rig/rig_files.h"
#include "spartan/rig/rig_writing.h"
#include "spartan/testing/real_data.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), with);
}

std::string complaint(const Result<ReadRig>& read) {
  if (read) return "nothing";
  EXPECT_EQ(read.error().code, ErrorCode::configuration);
  return read.error().message();
}

// Where the body's point is seen, brought to 1 m from the camera: mrcal does so before it looks, and only CAHVORE,
// which is not central, sees a difference.
Eigen::Vector2d seen(const Rig& rig, const char* camera, const Eigen::Vector3d& point) {
  return project(rig.find_camera(camera)->model, (rig.body_from_camera(camera).inverse() * point).normalized()).value();
}

Eigen::Vector3d right_in_left(const Rig& rig) {
  return rig.right_from_left(rig.pairs[0]).inverse().translation();
}

// --- Kalibr ---

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

TEST(KalibrCalib, TheChainLeadsFromCameraToCamera) {
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
  // Camera 2 looks along x of camera 1, whose p = (x, y, z) is (0.5 − z, y, x) for it: its place is (0, 0, 0.5) there.
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

TEST(KalibrCalib, TheImuIsTheBodyWhereItIsKnown) {
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
  ASSERT_EQ(read->notes.size(), 2u);
  EXPECT_THAT(read->notes[0], HasSubstr("IMU"));
  EXPECT_THAT(read->notes[1], HasSubstr("cam0: timeshift_cam_imu, -8.121e-05 s, is not used"));
  const std::string other = replaced(imu, "0.07", "0.09");
  const std::string both = replaced(replaced(kCamchain, "  rostopic: /cam0/image_raw\n", imu),
                                    "  resolution: [640, 400]\n", other + "  resolution: [640, 400]\n");
  EXPECT_THAT(complaint(read_calibration(folder.write("camchain.yaml", both))), HasSubstr("contradicts T_cn_cnm1"));
}

TEST(KalibrCalib, WhatIsNotOursIsRefusedByName) {
  const TemporaryFolder folder;
  const auto said = [&](const std::string& what, const std::string& with) {
    return complaint(read_calibration(folder.write("camchain.yaml", replaced(kCamchain, what, with))));
  };
  EXPECT_THAT(said("distortion_coeffs: [0, 0", "distortion_coeffs: [0.1, 0"),
              HasSubstr("camchain.yaml:12: cam1.distortion_coeffs: omni with a distortion besides is not supported"));
  EXPECT_THAT(said("model: radtan", "model: fov"), HasSubstr("camchain.yaml:4: cam0.distortion_model: is 'fov'"));
  EXPECT_THAT(said("camera_model: ds", "camera_model: eucm"), HasSubstr("cam2.intrinsics: eucm with beta = 0.59"));
  EXPECT_THAT(said("ds\n  intrinsics: [-0.2, 0.59", "eucm\n  intrinsics: [0.6, 1"), HasSubstr("nothing"));
  EXPECT_THAT(said("-0.2, 0.59", "-0.2, 1.59"), HasSubstr("alpha is 1.59"));
}

// --- ROS ---

// The structure of camera_calibration_parsers; R turns each eye by the same 0.1 rad about y, P has fx' = 400.
std::string camera_info(const char* name, double tx, const char* model = "plumb_bob",
                        const char* d = "-0.2, 0.1, 0.001, -0.002, 0.02") {
  const double c = std::cos(0.1), s = std::sin(0.1);
  return fmt::format(
      "image_width: 640\nimage_height: 480\ncamera_name: narrow_stereo/{}\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
      "  data: [430, 0, 320.5, 0, 431, 240.5, 0, 0, 1]\ndistortion_model: {}\ndistortion_coefficients:\n  rows: 1\n"
      "  cols: 5\n  data: [{}]\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: [{}, 0, {}, 0, 1, 0, {}, 0, {}]\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [400, 0, 310, {}, 0, 400, 230, 0, 0, 0, 1, 0]\n",
      name, model, d, c, s, -s, c, tx);
}

TEST(RosCalib, TheBaselineIsInTheRightProjection) {
  const TemporaryFolder folder;
  folder.write("right.yaml", camera_info("right", -48));
  const auto read = read_calibration(folder.write("left.yaml", camera_info("left", 0)));
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->format, CalibrationFormat::ros);
  // 0.12 m along x of the rectified frame, which is Rᵀ (0.12, 0, 0) in the camera.
  const Eigen::Vector3d expected(0.12 * std::cos(0.1), 0, 0.12 * std::sin(0.1));
  EXPECT_LE((right_in_left(read->rig) - expected).norm(), 1e-15);
  EXPECT_LE(rotation_angle(read->rig.right_from_left(read->rig.pairs[0])), 1e-15);
  EXPECT_EQ(read->rig.cameras[0].model,
            CameraModel(RadialTangentialModel({430, 431, 320.5, 240.5}, {-0.2, 0.1, 0.001, -0.002, 0.02})));
  EXPECT_EQ(read->rig.cameras[1].size, (ImageSize{640, 480}));
}

TEST(RosCalib, MessagesAreReadToo) {
  const TemporaryFolder folder;
  const auto message = [](bool ros2, double tx) {
    const char* names = ros2 ? "dkrp" : "DKRP";
    return fmt::format(
        "header:\n  frame_id: x\nheight: 480\nwidth: 640\ndistortion_model: rational_polynomial\n"
        "{}: [0.1, 0.2, 0, 0, 0.01, 0.3, 0.1, 0.02]\n{}: [430.0, 0.0, 320.5, 0.0, 431.0, 240.5, 0.0, 0.0, 1.0]\n"
        "{}: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]\n"
        "{}: [400.0, 0.0, 310.0, {}, 0.0, 400.0, 230.0, 0.0, 0.0, 0.0, 1.0, 0.0]\nbinning_x: 0\nbinning_y: 0\n---\n",
        names[0], names[1], names[2], names[3], tx);
  };
  for (const bool ros2 : {false, true}) {
    const auto both = folder.write("l.yaml", message(ros2, 0)) + "," + folder.write("r.yaml", message(ros2, -40));
    const auto read = read_calibration(both);
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_NEAR(right_in_left(read->rig).x(), 0.1, 1e-15);
    EXPECT_EQ(parameters(read->rig.cameras[0].model)[2].size(), 8u);
  }
  const auto binned = replaced(message(true, 0), "binning_x: 0", "binning_x: 2");
  EXPECT_THAT(complaint(read_calibration(folder.write("l.yaml", binned))), HasSubstr("l.yaml:10: binning_x"));
}

TEST(RosCalib, KindsAndFaultsAreNamed) {
  const TemporaryFolder folder;
  folder.write("right.yaml", camera_info("right", -48, "equidistant", "0.1, 0.02, 0.003, 0.004"));
  const auto said = [&](const std::string& text) {
    return complaint(read_calibration(folder.write("left.yaml", text)));
  };
  EXPECT_EQ(said(camera_info("left", 0, "equidistant", "0.1, 0.02, 0.003, 0.004")), "nothing");
  EXPECT_EQ(read_rig(folder.path() + "/left.yaml")->cameras[0].model,
            CameraModel(EquidistantModel({430, 431, 320.5, 240.5}, {0.1, 0.02, 0.003, 0.004})));
  EXPECT_THAT(said(camera_info("left", 0, "thin_prism")), HasSubstr("left.yaml:8: distortion_model: is 'thin_prism'"));
  EXPECT_THAT(said(camera_info("left", -48)), HasSubstr("right.yaml: projection_matrix: Tx is that of the left file"));
  EXPECT_THAT(said(replaced(camera_info("left", 0), "data: [430, 0,", "data: [430, 3,")), HasSubstr("camera_matrix"));
}

// --- mrcal, JPL: files that mrcal 2.2 wrote, and where it says that the point (3, 0.4, 0.2) is seen ---

struct OfMrcal {
  const char *name, *numbers, *cahvor_model, *cahvor_lines;
  Eigen::Vector2d left, right;
};
const OfMrcal kOfMrcal[] = {
    {"PINHOLE", "", "CAHV = perspective, linear", "", {565.30695802, 282.08847828}, {525.33661675, 272.78024447}},
    {"OPENCV4",
     " -0.1, 0.02, 0.0004, -0.0007,",
     "CAHV = perspective, linear",
     "LENSMODEL_OPENCV4 =   -0.1000000000    0.0200000000    0.0004000000   -0.0007000000\n",
     {565.46936326, 282.27740384},
     {525.78603331, 273.15118749}},
    {"OPENCV8",
     " 0.1, -0.2, 0.0004, -0.0007, 0.05, 0.3, -0.15, 0.04,",
     "CAHV = perspective, linear",
     "LENSMODEL_OPENCV8 =    0.1000000000   -0.2000000000    0.0004000000   -0.0007000000    0.0500000000    "
     "0.3000000000   -0.1500000000    0.0400000000\n",
     {565.64935205, 282.4657228},
     {526.2776815, 273.52648981}},
    {"CAHVOR",
     " 0.01, -0.02, 0.001, -0.1, 0.02,",
     "CAHVOR = perspective, distortion",
     "O =    {}\nR =    0.0010000000   -0.1000000000    0.0200000000\n",
     {565.40525174, 282.165703},
     {525.71437322, 273.00856851}},
    {"CAHVORE_linearity=0.40",
     " 0.01, -0.02, 0.001, -0.1, 0.02, 0.002, -0.001, 0.0003,",
     "CAHVORE3,0.40 = general",
     "O =    {}\nR =    0.0010000000   -0.1000000000    0.0200000000\n"
     "E =    0.0020000000   -0.0010000000    0.0003000000\n",
     {565.90303118, 282.55678472},
     {527.07792514, 273.83272829}},
};

std::string cameramodel(const OfMrcal& of, bool left) {
  const char* place = left ? "1.450793522, -1.465374484, 1.00454599, 0.07658262933, 0.8785734014, 0.214111838"
                           : "1.472013065, -1.472013065, 1.028903554, -0.06777136222, 0.8771103171, 0.2229002783";
  return fmt::format(
      "# a note\n{{\n    'lensmodel':  'LENSMODEL_{}',\n\n    # intrinsics are "
      "fx,fy,cx,cy,distortion0,distortion1,....\n"
      "    'intrinsics': [ 700, 701.5, 640.25, 360.5,{}],\n\n    'valid_intrinsics_region': [\n    [ 0, 0 ],\n    [ "
      "10, 0 "
      "],\n    [ 10, 10 ],\n    [ 0, 0 ],\n],\n\n    # extrinsics are rt_fromref\n    'extrinsics': [ {},],\n\n"
      "    'imagersize': [ 1280, 720,],\n\n    'icam_intrinsics': 0,\n\n    'optimization_inputs': "
      "b'P)h>@6aWYS2ml*O00{{xUS#u{{1d',\n}}\n",
      of.name, of.numbers, place);
}

std::string cahvor(const OfMrcal& of, bool left) {
  const std::string o =
      left ? "0.9459821133   -0.0009361639   -0.3242174655" : "0.9425976388   -0.0192241307   -0.3333768501";
  std::string lines = of.cahvor_lines;
  if (const std::size_t at = lines.find("{}"); at != std::string::npos) lines.replace(at, 2, o);
  return fmt::format(
      "Dimensions = 1280 720\nModel = {}\n{}{}"
      "VALID_INTRINSICS_REGION = 0.00 0.00 10.00 0.00 10.00 10.00 0.00 0.00 \nHs = 700.0\nHc = 640.25\n"
      "Vs = 701.5\nVc = 360.5\n# this is hard-coded\nTheta = -1.5707963267948966 (-90.0 deg)\n",
      of.cahvor_model,
      left
          ? "C =    0.1000000000    0.0600000000    0.9000000000\nA =    0.9393257446    0.0093935706   -0.3428978075\n"
            "H =  603.6017821237 -693.8587800951 -232.6906624729\nV =   98.0039622846   15.0098384600 -782.4528280516\n"
          : "C =    0.1000000000   -0.0600000000    0.9000000000\nA =    0.9358500292   -0.0093588123   -0.3522742333\n"
            "H =  594.6442031113 -705.9466402538 -218.9924092760\nV =   90.2081244458   -7.9173451577 "
            "-783.4936565982\n",
      lines);
}

TEST(MrcalCalib, SeesWhatMrcalSees) {
  for (const OfMrcal& of : kOfMrcal) {
    SCOPED_TRACE(of.name);
    const TemporaryFolder folder;
    folder.write("right.cameramodel", cameramodel(of, false));
    const auto read = read_calibration(folder.write("left.cameramodel", cameramodel(of, true)));
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_EQ(read->rig.convention, PoseConvention::body);
    // The files hold ten digits.
    EXPECT_LE((seen(read->rig, "left", {3, 0.4, 0.2}) - of.left).norm(), 1e-5);
    EXPECT_LE((seen(read->rig, "right", {3, 0.4, 0.2}) - of.right).norm(), 1e-5);
    EXPECT_EQ(read->rig.cameras[0].size, (ImageSize{1280, 720}));
  }
}

TEST(CahvorCalib, SeesWhatMrcalSees) {
  for (const OfMrcal& of : kOfMrcal) {
    SCOPED_TRACE(of.name);
    const TemporaryFolder folder;
    folder.write("right.cahvor", cahvor(of, false));
    const auto read = read_calibration(folder.write("left.cahvor", cahvor(of, true)));
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_LE((seen(read->rig, "left", {3, 0.4, 0.2}) - of.left).norm(), 1e-5);
    EXPECT_LE((seen(read->rig, "right", {3, 0.4, 0.2}) - of.right).norm(), 1e-5);
  }
}

TEST(MrcalCalib, OtherModelsAreRefusedByName) {
  const TemporaryFolder folder;
  folder.write("right.cameramodel", cameramodel(kOfMrcal[0], false));
  const auto said = [&](const std::string& what, const std::string& with) {
    return complaint(
        read_calibration(folder.write("left.cameramodel", replaced(cameramodel(kOfMrcal[0], true), what, with))));
  };
  EXPECT_THAT(said("LENSMODEL_PINHOLE", "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3"),
              HasSubstr("left.cameramodel:3: lensmodel: LENSMODEL_SPLINED_STEREOGRAPHIC_order=3 is not supported"));
  EXPECT_THAT(said("LENSMODEL_PINHOLE", "LENSMODEL_LATLON"), HasSubstr("LATLON is not supported"));
  EXPECT_THAT(said("LENSMODEL_PINHOLE", "DISTORTION_PINHOLE"), HasSubstr("nothing"));
  EXPECT_THAT(said("360.5,", "360.5, 1,"), HasSubstr("left.cameramodel:6: intrinsics: has 5 numbers, must have 4"));
}

// What JPL's and Ames' own programs write beside that.
TEST(CahvorCalib, EveryWayToSayALinearityIsKnown) {
  const auto linearity = [](const std::string& model, const std::string& further) {
    const TemporaryFolder folder;
    OfMrcal of = kOfMrcal[4];
    of.cahvor_model = model.c_str();
    const auto text = [&](bool left) { return cahvor(of, left) + further; };
    folder.write("r.cahvore", text(false));
    const auto read = read_calibration(folder.write("l.cahvore", text(true)));
    if (!read) return complaint(read);
    return fmt::format("{}", std::get<CahvoreModel>(read->rig.cameras[0].model).linearity());
  };
  EXPECT_EQ(linearity("CAHVORE1 = perspective, distortion, pupil", ""), "1");
  EXPECT_EQ(linearity("CAHVORE2 = fish-eye", ""), "0");
  EXPECT_EQ(linearity("CAHVORE3,0.25 = general", ""), "0.25");
  EXPECT_EQ(linearity("CAHVORE3,-0.25 = general", ""), "-0.25");
  EXPECT_EQ(linearity("CAHVORE", "T = 2\nP = 0\n"), "0");
  EXPECT_EQ(linearity("CAHVORE", "T = 3\nP = 0.5\n"), "0.5");
  EXPECT_THAT(linearity("CAHVORE3 = general", ""), HasSubstr("l.cahvore:2: Model: must be CAHVORE of type"));
  EXPECT_THAT(linearity("CAHVORE3,2 = general", ""), HasSubstr("Model"));
  EXPECT_THAT(linearity("CAHVORE4 = odd", ""), HasSubstr("Model"));
  EXPECT_THAT(linearity("CAHVORE", ""), HasSubstr("E: a CAHVORE must say its type"));
  EXPECT_THAT(linearity("RPC = odd", ""), HasSubstr("Model: RPC is not supported"));
}

TEST(CahvorCalib, ASkewIsKept) {
  const TemporaryFolder folder;
  // A = z, H = (fx, 0, cx), V = (skew, fy, cy).
  const auto text = [](double x) {
    return fmt::format(
        "Model = CAHV = perspective, linear\nDimensions = 640 480\nC = {} 0 0\nA = 0 0 1\nH = 500 0 320\n"
        "V = 0.25 501 240\n",
        x);
  };
  folder.write("right.cahv", text(0.1));
  const auto read = read_calibration(folder.write("left.cahv", text(0)));
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->rig.cameras[0].model, CameraModel(CahvModel{{500, 501, 320, 240}, 0.25}));
  EXPECT_EQ(read->rig.convention, PoseConvention::left_optical) << "no frame that REP-103 knows";
  EXPECT_LE((right_in_left(read->rig) - Eigen::Vector3d(0.1, 0, 0)).norm(), 1e-15);
}

// --- Ames ---

// The left camera of the K10 rover as the Ames Stereo Pipeline ships it (Apache-2.0), and one 10 cm to its right.
const std::string kTsai =
    "fu = 620.857971191406\nfv = 622.298034667969\ncu = 526.128784179688\ncv = 374.273742675781\n"
    "u_direction = 1 0 0\nv_direction = 0 1 0\nw_direction = 0 0 1\nC = 0.0751 -0.065 -0.902\n"
    "R = 0.000794376506820371 -0.371711462117335 0.928347972420126 0.997550683961614 -0.0646367856775087 "
    "-0.0267342264708707 0.0699428473375328 0.92609539188351 0.370749677327501\n"
    "k1 = -0.331998556852341\nk2 = 0.125557452440262\np1 = -0.000432605884270742\np2 = 0.00110327918082476\n";

class TsaiCalib : public ::testing::Test {
 protected:
  Result<ReadRig> read(const std::string& left, ImageSize size = {1024, 768}) {
    folder_.write("k_right.tsai", replaced(kTsai, "-0.065", "0.035"));
    return read_calibration(folder_.write("k_left.tsai", left), size);
  }
  TemporaryFolder folder_;
};

TEST_F(TsaiCalib, AForwardRightDownFrameIsTurned) {
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

TEST_F(TsaiCalib, DistortionAndPitchAreAsTheProjectHasThem) {
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
  // Picture axes that are not those of the camera: u to the camera's y, v to its −x.
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

TEST_F(TsaiCalib, FaultsAreNamed) {
  const auto said = [&](const std::string& what, const std::string& with) {
    return complaint(read(replaced(kTsai, what, with)));
  };
  for (const char* kind : {"AdjustableTSAI", "BrownConrady", "Photometrix", "RPC"}) {
    EXPECT_THAT(
        complaint(read("VERSION_4\nPINHOLE\n" + replaced(kTsai, "k1 =", std::string("pitch = 1\n") + kind + "\nk1 ="))),
        HasSubstr(fmt::format("k_left.tsai:13: '{}' is not supported", kind)));
  }
  EXPECT_THAT(said("R = 0.0007", "R = 0.7"), HasSubstr("k_left.tsai:9: R: is not a rotation matrix"));
  EXPECT_THAT(said("u_direction = 1", "u_direction = 2"), HasSubstr("k_left.tsai:5: u_direction: with v_direction"));
  EXPECT_THAT(said("k2 = 0.1", "k9 = 0.1"), HasSubstr("k_left.tsai: the line 'k2=' is missing"));
  EXPECT_THAT(said("fu = 620", "fu = -620"), HasSubstr("k_left.tsai:1: fu: the focal length must be above zero"));
  EXPECT_THAT(complaint(read(kTsai, {})), HasSubstr("image size is not known"));
}

// --- OpenCV ---

cv::Mat row(const std::vector<double>& numbers, int rows = 1) {
  return cv::Mat(numbers, true).reshape(1, rows);
}

std::string opencv_file(const std::function<void(cv::FileStorage&)>& fill) {
  cv::FileStorage file("memory.yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  file << "image_width" << 640 << "image_height" << 480;
  fill(file);
  return file.releaseAndGetString();
}

TEST(OpencvFiles, AFisheyeHasToSaySo) {
  const TemporaryFolder folder;
  const auto text = [&](const std::function<void(cv::FileStorage&)>& say) {
    return opencv_file([&](cv::FileStorage& file) {
      say(file);
      for (const char* eye : {"1", "2"}) {
        file << std::string("K") + eye << row({300, 0, 320, 0, 301, 240, 0, 0, 1}, 3);
        file << std::string("D") + eye << row({0.1, 0.02, 0.003, 0.0004}, 4);
      }
      file << "R" << row({1, 0, 0, 0, 1, 0, 0, 0, 1}, 3) << "T" << row({-0.1, 0, 0}, 3);
    });
  };
  const auto model = [&](const std::string& content) {
    return std::string(name_of(read_rig(folder.write("stereo.yml", content)).value().cameras[0].model));
  };
  EXPECT_EQ(model(text([](cv::FileStorage&) {})), "radial_tangential");
  EXPECT_EQ(model(text([](cv::FileStorage& f) { f << "fisheye_model" << 0; })), "radial_tangential");
  EXPECT_EQ(model(text([](cv::FileStorage& f) { f << "fisheye_model" << 1; })), "equidistant");
  EXPECT_EQ(model(text([](cv::FileStorage& f) {
              f << "camera_model"
                << "fisheye";
            })),
            "equidistant");
  EXPECT_EQ(model(text([](cv::FileStorage& f) {
              f << "distortion_model"
                << "equidistant";
            })),
            "equidistant");
}

TEST(OpencvFiles, TheRectificationTellsThePairToo) {
  const TemporaryFolder folder;
  const double c = std::cos(0.1), s = std::sin(0.1);
  const auto fill = [&](cv::FileStorage& file, bool with_eyes) {
    for (const char* eye : {"1", "2"}) {
      if (!with_eyes) continue;
      file << std::string("M") + eye << row({300, 0, 320, 0, 301, 240, 0, 0, 1}, 3);
      file << std::string("D") + eye << row({0, 0, 0, 0, 0});
    }
    file << "R1" << row({c, 0, s, 0, 1, 0, -s, 0, c}, 3) << "R2" << row({1, 0, 0, 0, 1, 0, 0, 0, 1}, 3);
    file << "P1" << row({290, 0, 310, 0, 0, 290, 230, 0, 0, 0, 1, 0}, 3);
    file << "P2" << row({290, 0, 310, -29, 0, 290, 230, 0, 0, 0, 1, 0}, 3);
  };
  const auto raw = read_rig(folder.write("a.yml", opencv_file([&](auto& file) { fill(file, true); })));
  ASSERT_TRUE(raw) << raw.error().message();
  // R2 X_r = R1 X_l − (0.1, 0, 0).
  const Pose right_from_left = raw->right_from_left(raw->pairs[0]);
  EXPECT_LE((right_from_left.translation() - Eigen::Vector3d(-0.1, 0, 0)).norm(), 1e-15);
  EXPECT_LE((right_from_left * Eigen::Vector3d(0, 0, 1) - Eigen::Vector3d(s - 0.1, 0, c)).norm(), 1e-15);
  const auto rectified = read_rig(folder.write("b.yml", opencv_file([&](auto& file) { fill(file, false); })));
  ASSERT_TRUE(rectified) << rectified.error().message();
  EXPECT_EQ(rectified->cameras[0].model, CameraModel(PinholeModel{290, 290, 310, 230}));
  EXPECT_LE((right_in_left(*rectified) - Eigen::Vector3d(0.1, 0, 0)).norm(), 1e-15);
  EXPECT_LE(rotation_angle(rectified->right_from_left(rectified->pairs[0])), 1e-15);
}

TEST(OpencvFiles, ThinPrismsMustBeZero) {
  const TemporaryFolder folder;
  const auto read = [&](double prism) {
    return read_calibration(
        folder.write("s.yml", opencv_file([&](cv::FileStorage& file) {
                       for (const char* eye : {"1", "2"}) {
                         file << std::string("M") + eye << row({300, 0, 320, 0, 301, 240, 0, 0, 1}, 3);
                         file << std::string("D") + eye << row({0.1, 0, 0, 0, 0, 0.2, 0, 0, prism, 0, 0, 0});
                       }
                       file << "R" << row({0, 0.1, 0}, 3) << "T" << row({-0.1, 0, 0}, 3);
                     })));
  };
  ASSERT_TRUE(read(0)) << read(0).error().message();
  EXPECT_NEAR(rotation_angle(read(0)->rig.right_from_left(read(0)->rig.pairs[0])), 0.1, 1e-15) << "R as a vector";
  EXPECT_THAT(complaint(read(1e-9)), HasSubstr("D1: thin-prism"));
}

// --- what formats cannot hold ---

TEST(CalibrationWriting, WhatAFormatCannotHoldIsRefusedByCamera) {
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
              HasSubstr("cameras.left: kitti holds rectified"));
  EXPECT_THAT(refusal(fisheye, CalibrationFormat::tsai, "a.tsai"),
              HasSubstr("cameras.left: .tsai has no model like equi"));
  EXPECT_THAT(refusal(fisheye, CalibrationFormat::mrcal, "a.cameramodel"),
              HasSubstr("cameras.left: mrcal's files have no"));
  EXPECT_THAT(refusal(fisheye, CalibrationFormat::cahvor, "a.cahvor"), HasSubstr("cameras.left: .cahvor has no model"));
  EXPECT_THAT(refusal(rational, CalibrationFormat::kalibr, "a.yaml"), HasSubstr("cameras.left: this format has four"));
  EXPECT_THAT(refusal(rational, CalibrationFormat::tsai, "a.tsai"), HasSubstr("no coefficients k4, k5, k6"));
  EXPECT_THAT(refusal(skewed, CalibrationFormat::mrcal, "a.cameramodel"),
              HasSubstr("cameras.left: mrcal's cameras have no skew"));
  EXPECT_THAT(refusal(skewed, CalibrationFormat::ros, "a.yaml"), HasSubstr("cameras.left: ROS has no model like cahv"));
  EXPECT_THAT(refusal(skewed, CalibrationFormat::opencv, "a.yml"),
              HasSubstr("cameras.left: OpenCV has no model like cahv"));
  EXPECT_THAT(refusal(skewed, CalibrationFormat::euroc, "a"),
              HasSubstr("cameras.left: this format has no model like cahv"));
  EXPECT_EQ(refusal(skewed, CalibrationFormat::cahvor, "a.cahvor"), "nothing");

  left.model = right.model = pinhole;
  const Rig turned = rig_of_one_pair("r", left, right, Pose(exp_so3({0, 0.01, 0}), {-0.1, 0, 0}));
  EXPECT_THAT(to_calibration_files(turned, CalibrationFormat::kitti, "calib.txt").error().message(),
              HasSubstr("cameras.right: kitti holds rectified pairs only; this camera is turned by 0.01 rad"));
  Rig three = turned;
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
