// ROS camera_info: its documented examples and manually computed values.
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

// A file as written by camera_calibration_parsers; R rotates both cameras by 0.1 rad about y, P has fx' = 400.
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

TEST(RosCalib, TheBaselineComesFromTheRightProjection) {
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

TEST(RosCalib, ReadsMessages) {
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
  EXPECT_THAT(error_message(read_calibration(folder.write("l.yaml", binned))), HasSubstr("l.yaml:10: binning_x"));
}

// A region of interest changes the principal point and the image size.
TEST(RosCalib, RejectsARegionOfInterest) {
  const TemporaryFolder folder;
  folder.write("right.yaml", camera_info("right", -48));
  const auto message_for = [&](const std::string& roi) {
    return error_message(read_calibration(folder.write("left.yaml", camera_info("left", 0) + roi)));
  };
  EXPECT_THAT(message_for("roi: {x_offset: 100, y_offset: 50, width: 300, height: 200}\n"),
              HasSubstr("left.yaml:21: roi: is a part of the image"));
  EXPECT_THAT(message_for("roi: {x_offset: 0, y_offset: 50, width: 0, height: 0}\n"), HasSubstr("left.yaml:21: roi"));
  EXPECT_THAT(message_for("roi: {x_offset: 0, y_offset: 0, width: 640, height: 200}\n"),
              HasSubstr("left.yaml:21: roi"));
  EXPECT_THAT(message_for("roi: {x_offset: nan, y_offset: 0, width: 0, height: 0}\n"),
              HasSubstr("roi.x_offset: is nan"));
  EXPECT_THAT(message_for("roi: none\n"), HasSubstr("roi: must be a group"));
  EXPECT_EQ(message_for("roi:\n  x_offset: 0\n  y_offset: 0\n  height: 0\n  width: 0\n  do_rectify: false\n"),
            "nothing");
  EXPECT_EQ(message_for("roi: {x_offset: 0, y_offset: 0, width: 640, height: 480}\n"), "nothing");
}

TEST(RosCalib, NoDistortionHasNoCoefficients) {
  const TemporaryFolder folder;
  folder.write("right.yaml", camera_info("right", -48));
  const auto message_for = [&](const char* model, const char* d) {
    return error_message(read_calibration(folder.write("left.yaml", camera_info("left", 0, model, d))));
  };
  for (const char* model : {"none", "''"}) {
    EXPECT_EQ(message_for(model, "0, 0, 0, 0, 0"), "nothing");
    EXPECT_EQ(message_for(model, ""), "nothing");
    EXPECT_THAT(
        message_for(model, "-0.2, 0, 0, 0, 0"),
        HasSubstr("left.yaml:9: distortion_coefficients: are not zero, but distortion_model has no coefficients"));
  }
  EXPECT_THAT(message_for("fov", "0, 0, 0, 0, 0"), ::testing::EndsWith("equidistant, fisheye, radtan, none"));
}

// R and P define a rectification, which a Rig does not represent.
TEST(RosCalib, AnotherRectificationIsIgnored) {
  const TemporaryFolder folder;
  const auto ignored = [&](const std::string& left, const std::string& right) {
    folder.write("right.yaml", right);
    return read_calibration(folder.write("left.yaml", left)).value();
  };
  const LoadedRig read = ignored(camera_info("left", 0), camera_info("right", -48));
  ASSERT_EQ(read.ignored.size(), 1u);
  EXPECT_EQ(read.ignored[0].key, "projection_matrix");
  EXPECT_THAT(read.ignored[0].text, HasSubstr("(fx 400, cx 310; right 400, 310)"));
  const auto own = to_calibration_files(read.rig, CalibrationFormat::ros, "left.yaml,right.yaml").value();
  EXPECT_TRUE(ignored(own[0].content, own[1].content).ignored.empty()) << "the same rectification would be written";
}

TEST(RosCalib, ReadsModelsAndReportsErrors) {
  const TemporaryFolder folder;
  folder.write("right.yaml", camera_info("right", -48, "equidistant", "0.1, 0.02, 0.003, 0.004"));
  const auto message_for = [&](const std::string& text) {
    return error_message(read_calibration(folder.write("left.yaml", text)));
  };
  EXPECT_EQ(message_for(camera_info("left", 0, "equidistant", "0.1, 0.02, 0.003, 0.004")), "nothing");
  EXPECT_EQ(read_rig(folder.path() + "/left.yaml")->cameras[0].model,
            CameraModel(EquidistantModel({430, 431, 320.5, 240.5}, {0.1, 0.02, 0.003, 0.004})));
  EXPECT_THAT(message_for(camera_info("left", 0, "thin_prism")),
              HasSubstr("left.yaml:8: distortion_model: is 'thin_prism'"));
  EXPECT_THAT(message_for(camera_info("left", -48)),
              HasSubstr("right.yaml: projection_matrix: Tx equals that of the left file"));
  EXPECT_THAT(message_for(replaced(camera_info("left", 0), "data: [430, 0,", "data: [430, 3,")),
              HasSubstr("camera_matrix"));
}

}  // namespace
}  // namespace spartan::internal
