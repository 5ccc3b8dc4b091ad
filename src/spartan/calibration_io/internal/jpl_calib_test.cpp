// mrcal and JPL files written by mrcal 2.2, with its projections of the point (3, 0.4, 0.2).
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/rig/describe.h"
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

// The projection of a point in the body frame, normalized to 1 m from the camera as in mrcal, which matters only for
// the non-central CAHVORE.
Eigen::Vector2d projected(const Rig& rig, const char* camera, const Eigen::Vector3d& point) {
  return project(rig.find_camera(camera)->model, (rig.body_from_camera(camera).inverse() * point).normalized()).value();
}

struct MrcalCase {
  const char *name, *numbers, *cahvor_model, *cahvor_lines;
  Eigen::Vector2d left, right;
};
const MrcalCase kMrcalCases[] = {
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

std::string cameramodel(const MrcalCase& of, bool left) {
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

std::string cahvor(const MrcalCase& of, bool left) {
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

TEST(MrcalCalib, ProjectsAsMrcal) {
  for (const MrcalCase& of : kMrcalCases) {
    SCOPED_TRACE(of.name);
    const TemporaryFolder folder;
    folder.write("right.cameramodel", cameramodel(of, false));
    const auto read = read_calibration(folder.write("left.cameramodel", cameramodel(of, true)));
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_EQ(read->rig.convention, PoseConvention::body);
    // The files have ten digits.
    EXPECT_LE((projected(read->rig, "left", {3, 0.4, 0.2}) - of.left).norm(), 1e-5);
    EXPECT_LE((projected(read->rig, "right", {3, 0.4, 0.2}) - of.right).norm(), 1e-5);
    EXPECT_EQ(read->rig.cameras[0].size, (ImageSize{1280, 720}));
  }
}

TEST(CahvorCalib, ProjectsAsMrcal) {
  for (const MrcalCase& of : kMrcalCases) {
    SCOPED_TRACE(of.name);
    const TemporaryFolder folder;
    folder.write("right.cahvor", cahvor(of, false));
    const auto read = read_calibration(folder.write("left.cahvor", cahvor(of, true)));
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_LE((projected(read->rig, "left", {3, 0.4, 0.2}) - of.left).norm(), 1e-5);
    EXPECT_LE((projected(read->rig, "right", {3, 0.4, 0.2}) - of.right).norm(), 1e-5);
  }
}

TEST(MrcalCalib, UnsupportedModelsAreNamed) {
  const TemporaryFolder folder;
  folder.write("right.cameramodel", cameramodel(kMrcalCases[0], false));
  const auto message_for = [&](const std::string& what, const std::string& with) {
    return error_message(
        read_calibration(folder.write("left.cameramodel", replaced(cameramodel(kMrcalCases[0], true), what, with))));
  };
  EXPECT_THAT(message_for("LENSMODEL_PINHOLE", "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3"),
              HasSubstr("left.cameramodel:3: lensmodel: LENSMODEL_SPLINED_STEREOGRAPHIC_order=3 is not supported"));
  EXPECT_THAT(message_for("LENSMODEL_PINHOLE", "LENSMODEL_LATLON"), HasSubstr("LATLON is not supported"));
  EXPECT_THAT(message_for("LENSMODEL_PINHOLE", "DISTORTION_PINHOLE"), HasSubstr("nothing"));
  EXPECT_THAT(message_for("360.5,", "360.5, 1,"),
              HasSubstr("left.cameramodel:6: intrinsics: has 5 numbers, must have 4"));
}

// Notations of the programs of JPL and Ames.
TEST(CahvorCalib, ReadsEveryNotationOfTheLinearity) {
  const auto linearity = [](const std::string& model, const std::string& further) {
    const TemporaryFolder folder;
    MrcalCase of = kMrcalCases[4];
    of.cahvor_model = model.c_str();
    const auto text = [&](bool left) { return cahvor(of, left) + further; };
    folder.write("r.cahvore", text(false));
    const auto read = read_calibration(folder.write("l.cahvore", text(true)));
    if (!read) return error_message(read);
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
  EXPECT_THAT(linearity("CAHVORE", ""), HasSubstr("E: a CAHVORE file must state its type"));
  EXPECT_THAT(linearity("RPC = odd", ""), HasSubstr("Model: RPC is not supported"));
}

// mrcal reads only the notation "CAHVORE3,<linearity> = general".
TEST(CahvorCalib, WritesTheNotationOfMrcal) {
  const std::regex mrcal_pattern("Model = CAHVORE3,([0-9.e-]+)\\s*=\\s*general");
  for (const double linearity : {1.0, 0.0, 0.37, -0.4, 1e-5}) {
    Camera left, right;
    left.name = "left";
    right.name = "right";
    left.size = right.size = {640, 480};
    left.model = right.model =
        CahvoreModel({{500, 501, 320, 240}, 0}, Eigen::Vector3d::UnitZ(), {0.01, 0.02, 0.03}, {0.001, 0, 0}, linearity);
    const Rig rig = rig_of_one_pair("r", left, right, Pose::from_translation({-0.12, 0, 0}));
    const auto files = to_calibration_files(rig, CalibrationFormat::cahvor, "p.cahvore").value();
    std::smatch found;
    ASSERT_TRUE(std::regex_search(files[0].content, found, mrcal_pattern)) << files[0].content;
    EXPECT_EQ(std::stod(found[1]), linearity);
    EXPECT_THAT(files[0].content, HasSubstr(fmt::format("\nT = 3\nP = {}\n", linearity)));
  }
}

// Vectors with six decimals give a skew of about 1e-4 px, which formats without skew must accept.
TEST(CahvorCalib, SkewFromRoundingIsAcceptedByOtherFormats) {
  const TemporaryFolder folder;
  const auto text = [](double y, double skew) {
    return fmt::format(
        "Model = CAHV = perspective, linear\nDimensions = 1024 1024\nC = 0 {} 0\nA = 1 0 0\n"
        "H = 512.5 -1200 0\nV = 511.5 {} -1201\n",
        y, -skew);
  };
  const auto rig = [&](double skew) {
    folder.write("right.cahv", text(-0.1, skew));
    return read_rig(folder.write("left.cahv", text(0.1, skew))).value();
  };
  const Rig rounded = rig(0.0003);
  EXPECT_EQ(name_of(rounded.cameras[0].model), "cahv");
  for (const auto& [format, name] : {std::pair{CalibrationFormat::mrcal, "p.cameramodel"},
                                     {CalibrationFormat::opencv, "p.yml"},
                                     {CalibrationFormat::ros, "p.yaml"},
                                     {CalibrationFormat::tsai, "p.tsai"},
                                     {CalibrationFormat::kalibr, "camchain.yaml"}}) {
    const auto files = to_calibration_files(rounded, format, name);
    ASSERT_TRUE(files) << name << ": " << files.error().message();
    const auto again = read_back(*files, format, {1024, 1024});
    ASSERT_TRUE(again) << again.error().message();
    const auto lost = describe_differences(rounded, again->rig);
    std::string keys, texts;
    for (const RigDifference& each : lost) {
      if (each.key.ends_with("name")) continue;
      if (each.key == "body" || each.key == "pose_convention") continue;
      keys += each.key + ";";
      texts += each.text + "\n";
    }
    EXPECT_EQ(keys, "cameras.left.skew_px;cameras.right.skew_px;") << name << "\n" << texts;
    EXPECT_THAT(texts, HasSubstr("[0.0003"));
    const std::string refused = to_calibration_files(rig(0.5), format, name).error().message();
    EXPECT_THAT(refused, HasSubstr("cameras.left: "));
    EXPECT_THAT(refused, HasSubstr("does not support skew, this camera has 0.5 px: 0.427 px across the image"));
  }
  EXPECT_TRUE(to_calibration_files(rig(0.5), CalibrationFormat::cahvor, "p.cahv"));
}

TEST(CahvorCalib, CommentsMayFollowNumbers) {
  const TemporaryFolder folder;
  const std::string right = cahvor(kMrcalCases[0], false);
  folder.write("right.cahvor", right);
  const std::string text =
      replaced(cahvor(kMrcalCases[0], true), "Dimensions = 1280 720", "Dimensions = 1280 720 # px");
  EXPECT_EQ(error_message(read_calibration(folder.write("left.cahvor", text))), "nothing");
  EXPECT_THAT(error_message(read_calibration(folder.write("left.cahvor", replaced(text, "720 # px", "# 720")))),
              HasSubstr("left.cahvor:1: Dimensions: has 1 numbers, must have 2"));
}

TEST(MrcalCalib, OtherContentOfMrcalFilesIsIgnored) {
  const TemporaryFolder folder;
  folder.write("right.cameramodel", cameramodel(kMrcalCases[0], false));
  const auto read = read_calibration(folder.write("left.cameramodel", cameramodel(kMrcalCases[0], true))).value();
  std::string keys;
  for (const RigDifference& each : read.ignored) keys += each.key + ";";
  EXPECT_EQ(keys,
            "left.valid_intrinsics_region;left.optimization_inputs;right.valid_intrinsics_region;"
            "right.optimization_inputs;");
}

// With the inputs of the optimization a file is large; the name does not matter.
TEST(MrcalCalib, LargeFilesAreReadUnderAnyName) {
  const TemporaryFolder folder;
  std::string left = cameramodel(kMrcalCases[0], true);
  left.insert(left.find("b'P)h") + 2, std::string(5U << 20U, 'x'));
  folder.write("right.txt", cameramodel(kMrcalCases[0], false));
  const auto read = read_calibration(folder.write("left.txt", left));
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->format, CalibrationFormat::mrcal);
}

TEST(CahvorCalib, TheSkewIsKept) {
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
  EXPECT_EQ(read->rig.convention, PoseConvention::left_optical) << "not a REP-103 frame";
  EXPECT_LE((right_in_left(read->rig) - Eigen::Vector3d(0.1, 0, 0)).norm(), 1e-15);
}

}  // namespace
}  // namespace spartan::internal
