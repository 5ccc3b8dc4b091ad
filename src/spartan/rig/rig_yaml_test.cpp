#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "spartan/core/pose.h"
#include "spartan/rig/rig.h"
#include "spartan/testing/doc_example.h"
#include "spartan/testing/temporary_folder.h"
#include "spartan/testing/text_checks.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;
using testing::replaced;

const std::string kGood = R"(schema: 1
cameras:
  l: {size_px: [64, 48], model: pinhole, focal_px: [50, 50], centre_px: [31.5, 23.5], axes: optical, translation_m: [0, 0, 0]}
  r:
    size_px: [64, 48]
    model: pinhole
    focal_px: [50, 50]
    centre_px: [31.5, 23.5]
    axes: optical
    translation_m: [0.1, 0, 0]
pairs:
  p: {left: l, right: r}
)";

// The error message for the valid file after a replacement.
std::string error_for(const std::string& what, const std::string& with) {
  return testing::error_message(parse_rig_yaml(replaced(kGood, what, with), "my.yaml"));
}

TEST(RigYaml, ReadsVignetting) {
  const auto rig = parse_rig_yaml(
      replaced(kGood, "axes: optical, ", "vignetting: [-0.3, 0.05], vignetting_centre_px: [30, 20.5], axes: optical, "),
      "my.yaml");
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->cameras[0].vignetting, (Vignetting{{-0.3, 0.05}, Eigen::Vector2d(30, 20.5)}));
  EXPECT_EQ(rig->cameras[1].vignetting, Vignetting());
  EXPECT_THAT(error_for("axes: optical, ", "vignetting: [], axes: optical, "), HasSubstr("cameras.l.vignetting"));
  EXPECT_THAT(error_for("axes: optical, ", "vignetting: [.nan], axes: optical, "), HasSubstr("cameras.l.vignetting"));
}

TEST(RigYaml, ReadsTheDriverOfACamera) {
  EXPECT_FALSE(parse_rig_yaml(kGood, "my.yaml")->cameras[0].driver);
  const auto with = [](const std::string& driver) {
    return replaced(kGood, "axes: optical, ", "driver: " + driver + ", axes: optical, ");
  };
  const auto rig = parse_rig_yaml(
      with("{source: 'aravis:Vendor-7', trigger: software, rate_hz: 12.5, black_level: 16, stamp_at: exposure_end, "
           "latency_ms: 3.5}"),
      "my.yaml");
  ASSERT_TRUE(rig) << rig.error().message();
  const CameraDriver wanted{"aravis:Vendor-7", CameraDriver::kSoftware, 12.5, 16, StampAt::exposure_end, 3.5};
  EXPECT_EQ(rig->cameras[0].driver, wanted);
  EXPECT_EQ(*parse_rig_yaml(to_rig_yaml(*rig), "again.yaml"), *rig);
  const auto documented =
      parse_rig_yaml(replaced(kGood, "pairs:", testing::doc_example("driver") + "pairs:"), "my.yaml");
  ASSERT_TRUE(documented) << documented.error().message();
  EXPECT_EQ(documented->cameras[1].driver,
            (CameraDriver{"aravis:Vendor-1234", CameraDriver::kSoftware, 10, 64, StampAt::exposure_start, 4}));
  EXPECT_EQ(parse_rig_yaml(with("{source: 'gst:videotestsrc'}"), "my.yaml")->cameras[0].driver,
            (CameraDriver{"gst:videotestsrc"}));
  const auto fault = [&](const std::string& driver) {
    return testing::error_message(parse_rig_yaml(with(driver), "my.yaml"));
  };
  EXPECT_THAT(fault("{trigger: free}"), HasSubstr("cameras.l.driver.source"));
  EXPECT_THAT(fault("{source: a, rate_hz: -1}"), HasSubstr("cameras.l.driver.rate_hz: is -1"));
  EXPECT_THAT(fault("{source: a, black_level: 255}"), HasSubstr("driver.black_level: must be below 255"));
  EXPECT_THAT(fault("{source: a, stamp_at: noon}"), HasSubstr("cameras.l.driver.stamp_at"));
  EXPECT_THAT(fault("{source: a, colour: red}"), HasSubstr("cameras.l.driver.colour"));
}

TEST(RigYaml, ReadsTheGeometryOfTheRover) {
  EXPECT_EQ(parse_rig_yaml(kGood, "my.yaml")->rover, RoverGeometry());
  const auto rig = parse_rig_yaml(kGood + "rover: {track_m: 0.35, clearance_m: 0.06}\n", "my.yaml");
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->rover, (RoverGeometry{0.35, 0.1, 0.06})) << "a missing key keeps its default";
  EXPECT_EQ(parse_rig_yaml(to_rig_yaml(*rig), "again.yaml")->rover, rig->rover);
  const auto fault = [](const std::string& rover) {
    return testing::error_message(parse_rig_yaml(kGood + "rover: " + rover + "\n", "my.yaml"));
  };
  EXPECT_THAT(fault("{track_m: 0}"), HasSubstr("rover.track_m: is 0, must be between 0.05 and 10 m"));
  EXPECT_THAT(fault("{wheel_radius_m: .inf}"), HasSubstr("rover.wheel_radius_m"));
  EXPECT_THAT(fault("{wheelbase_m: 1}"), HasSubstr("wheelbase_m"));
}

TEST(RigYaml, ReadsWhereTheImuAndTheWheelsAre) {
  EXPECT_EQ(parse_rig_yaml(kGood, "my.yaml")->imu, ImuMount());
  const auto rig = parse_rig_yaml(kGood +
                                      "imu: {translation_m: [0.1, 0, 0.4], roll_pitch_yaw_deg: [0, 0, 90], "
                                      "time_offset_s: -0.02}\nrover: {turning_centre_m: [-0.3, 0, 0.1]}\n",
                                  "my.yaml");
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->imu.body_from_imu.translation(), Eigen::Vector3d(0.1, 0, 0.4));
  EXPECT_LT((rig->imu.body_from_imu.rotation() * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-12);
  EXPECT_EQ(rig->imu.time_offset_s, -0.02);
  EXPECT_EQ(rig->turning_centre_m, Eigen::Vector3d(-0.3, 0, 0.1));
  EXPECT_EQ(*parse_rig_yaml(to_rig_yaml(*rig), "again.yaml"), *rig);
  const auto fault = [](const std::string& lines) {
    return testing::error_message(parse_rig_yaml(kGood + lines + "\n", "my.yaml"));
  };
  EXPECT_THAT(fault("imu: {translation_m: [0, 0, 300]}"), HasSubstr("imu.translation_m: must be within 10 m"));
  EXPECT_THAT(fault("imu: {translation_m: [0, 0, 0], time_offset_s: 20}"), HasSubstr("imu.time_offset_s"));
  EXPECT_THAT(fault("rover: {turning_centre_m: [.nan, 0, 0]}"), HasSubstr("rover.turning_centre_m"));
}

TEST(RigYaml, ReadsTheErrorsOfTheCalibration) {
  EXPECT_FALSE(parse_rig_yaml(kGood, "my.yaml")->calibration_errors.has_value());
  const auto rig = parse_rig_yaml(kGood + "calibration_errors: {scale_percent: 0.3, mount_mm: 0}\n", "my.yaml");
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->calibration_errors, (CalibrationErrors{0.025, 0.3, 0.15, 0, 0.1}))
      << "a missing key keeps its default";
  EXPECT_EQ(parse_rig_yaml(to_rig_yaml(*rig), "again.yaml")->calibration_errors, rig->calibration_errors);
  const auto fault = [](const std::string& errors) {
    return testing::error_message(parse_rig_yaml(kGood + "calibration_errors: " + errors + "\n", "my.yaml"));
  };
  EXPECT_THAT(fault("{pan_tilt_deg: -1}"), HasSubstr("calibration_errors.pan_tilt_deg: is a standard deviation"));
  EXPECT_THAT(fault("{mount_cm: 1}"), HasSubstr("calibration_errors.mount_cm"));
}

TEST(RigYaml, ReadsAMinimalFile) {
  const auto rig = parse_rig_yaml(kGood, "some/my.yaml");
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->name, "my");
  EXPECT_EQ(rig->convention, PoseConvention::body);
  ASSERT_EQ(rig->cameras.size(), 2u);
  EXPECT_EQ(rig->cameras[1].size, (ImageSize{64, 48}));
  EXPECT_EQ(rig->cameras[1].mount, "body");
  EXPECT_EQ(rig->cameras[1].pixel_format.bits, 8);
  EXPECT_EQ(rig->cameras[1].mount_from_camera.translation(), Eigen::Vector3d(0.1, 0, 0));
  EXPECT_TRUE(rig->pairs[0].for_odometry);
  EXPECT_EQ(rig->pairs[0].nearest_m, 0);
}

TEST(RigYaml, ReadsTheExampleInTheDocumentation) {
  const std::string text = testing::doc_example("rig.yaml");
  ASSERT_FALSE(text.empty());
  const auto rig = parse_rig_yaml(text, "docs/reference/rig.md");
  ASSERT_TRUE(rig) << rig.error().message();
  EXPECT_EQ(rig->name, "my_rover");
  ASSERT_EQ(rig->pan_tilt_units.size(), 1u);
  EXPECT_NEAR(rig->pan_tilt_units[0].rest_tilt_rad, 39 * kRadiansPerDegree, 1e-15);
  ASSERT_EQ(rig->cameras.size(), 4u);
  const Camera& left = rig->cameras[0];
  EXPECT_EQ(left.pixel_format, (PixelFormat{PixelLayout::bayer_rggb, 12, BitAlignment::low}));
  EXPECT_EQ(left.self_mask, "masks/mast_left.png");
  EXPECT_EQ(left.mount, "mast");
  EXPECT_EQ(parameters(left.model)[2], (std::vector<double>{-0.05, 0.01, 0.0001, -0.0002}));
  EXPECT_EQ(parameters(rig->cameras[1].model)[2].size(), 5u);
  EXPECT_FALSE(rig->pairs[0].for_odometry);
  EXPECT_EQ(rig->pairs[1].nearest_m, 0.3);
}

// Every key of the reader is documented, and every documented key is read.
TEST(RigYaml, TheDocumentationNamesEveryKey) {
  const std::string page = testing::reference_page("rig");
  const std::string section = page.substr(std::min(page.size(), page.find("| `schema` | 1 |")));
  const std::string messages =
      error_for("pairs:", "nonsense: 1\npairs:") + error_for("    model", "    nonsense: 1\n    model") +
      error_for("{left", "{nonsense: 1, left") +
      error_for("cameras:", "pan_tilt_units: {m: {translation_m: [0, 0, 0], nonsense: 1}}\ncameras:");
  for (const char* key : {"schema",
                          "name",
                          "pose_convention",
                          "pan_tilt_units",
                          "rest_angles_deg",
                          "rest_angles_rad",
                          "cameras",
                          "size_px",
                          "model",
                          "focal_px",
                          "centre_px",
                          "pixel_layout",
                          "bits",
                          "bit_alignment",
                          "vignetting",
                          "vignetting_centre_px",
                          "self_mask",
                          "mount",
                          "axes",
                          "translation_m",
                          "roll_pitch_yaw_deg",
                          "quaternion_xyzw",
                          "pairs",
                          "left",
                          "right",
                          "nearest_m",
                          "for_odometry"}) {
    EXPECT_THAT(messages, HasSubstr(key));
    EXPECT_NE(section.find(key), std::string::npos) << key;
  }
}

TEST(RigYaml, ReadsRollPitchYaw) {
  const auto viewing_direction = [](const std::string& angles) {
    const auto rig = parse_rig_yaml(replaced(replaced(kGood, "axes: optical\n", "axes: forward\n"), "[0.1, 0, 0]\n",
                                             "[0.1, 0, 0]\n    roll_pitch_yaw_deg: " + angles + "\n"),
                                    "my.yaml");
    return Eigen::Vector3d(rig.value().cameras[1].mount_from_camera.rotation() * Eigen::Vector3d::UnitZ());
  };
  EXPECT_LE((viewing_direction("[0, 0, 0]") - Eigen::Vector3d(1, 0, 0)).norm(), 1e-12);
  EXPECT_LE((viewing_direction("[0, 90, 0]") - Eigen::Vector3d(0, 0, -1)).norm(), 1e-12)
      << "a positive pitch viewing_direction down";
  EXPECT_LE((viewing_direction("[0, 0, 90]") - Eigen::Vector3d(0, 1, 0)).norm(), 1e-12)
      << "a positive yaw viewing_direction to the left";
  EXPECT_LE((viewing_direction("[77, 0, 0]") - Eigen::Vector3d(1, 0, 0)).norm(), 1e-12);
}

TEST(RigYaml, ErrorsNameFileLineAndKey) {
  EXPECT_EQ(error_for("schema: 1", "schema: 2"), "my.yaml:1: schema: is 2; this version reads schema 1");
  EXPECT_THAT(error_for("    model: pinhole", "    model: fisheye"), HasSubstr("my.yaml:6: cameras.r.model: "));
  EXPECT_THAT(error_for("    model: pinhole", "    modell: pinhole"),
              HasSubstr("my.yaml:6: cameras.r.modell: unknown key; did you mean model? known keys: "));
  EXPECT_THAT(error_for("    focal_px: [50, 50]", "    focal_px: [50]"),
              HasSubstr("my.yaml:7: cameras.r.focal_px: has 1 entries, must be a list of 2 numbers"));
  EXPECT_THAT(error_for("    focal_px: [50, 50]", "    focal_px: [50, .nan]"),
              HasSubstr("my.yaml:7: cameras.r.focal_px: is .nan, must be a finite number"));
  EXPECT_THAT(error_for("    focal_px: [50, 50]", "    focal_px: [50, inf]"), HasSubstr("must be a finite number"));
  EXPECT_THAT(error_for("    focal_px: [50, 50]", "    focal_px: [50, 0x]"), HasSubstr("'0x' is not a number"));
  EXPECT_THAT(error_for("    focal_px: [50, 50]", "    focal_px: [50, -3]"), HasSubstr("must be above zero"));
  EXPECT_THAT(error_for("    size_px: [64, 48]", "    size_px: [64, 48.5]"),
              HasSubstr("my.yaml:5: cameras.r.size_px: "));
  EXPECT_THAT(error_for("    axes: optical\n", ""), HasSubstr("cameras.r.axes"));
  EXPECT_THAT(error_for("[0.1, 0, 0]\n", "[0.1, 0, 0]\n    quaternion_xyzw: [1, 1, 0, 0]\n"),
              HasSubstr("has length 1.41421"));
  EXPECT_THAT(
      error_for("[0.1, 0, 0]\n", "[0.1, 0, 0]\n    quaternion_xyzw: [0, 0, 0, 1]\n    roll_pitch_yaw_deg: [0, 0, 0]\n"),
      HasSubstr("the rotation is given twice"));
  EXPECT_THAT(error_for("right: r", "right: x"), HasSubstr("my.yaml:12: pairs.p.right: there is no camera 'x'"));
  EXPECT_THAT(error_for("right: r", "right: l"), HasSubstr("pairs.p.right: left and right are the same camera"));
  EXPECT_THAT(error_for("[0.1, 0, 0]\n", "[0, 0, 0]\n"),
              HasSubstr("pairs.p: both cameras are at the same position: the baseline is zero"));
  EXPECT_THAT(error_for("pairs:\n  p: {left: l, right: r}\n", "pairs: {}\n"),
              HasSubstr("pairs: there is no stereo pair"));
  EXPECT_THAT(error_for("  r:\n", "  l:\n"), HasSubstr("my.yaml:3: cameras.l: is given twice, again in line 4"));
  EXPECT_THAT(error_for("{left: l", "[left: l"), HasSubstr("not valid YAML"));
  EXPECT_FALSE(parse_rig_yaml("", "my.yaml"));
  EXPECT_FALSE(parse_rig_yaml("just words", "my.yaml"));
}

TEST(RigYaml, AllErrorsAreReportedAtOnce) {
  std::string text = replaced(kGood, "    focal_px: [50, 50]", "    focal_px: [50]");
  text = replaced(text, "right: r}", "right: r, colour: red}");
  text = replaced(text, "schema: 1", "schema: one");
  const auto rig = parse_rig_yaml(text, "my.yaml");
  ASSERT_FALSE(rig);
  for (const char* part : {"my.yaml:1: schema", "my.yaml:7: cameras.r.focal_px", "my.yaml:12: pairs.p.colour"}) {
    EXPECT_THAT(rig.error().message(), HasSubstr(part));
  }
}

TEST(RigYaml, TextMustBeUtf8) {
  const auto with_name = [](const std::string& name) {
    return parse_rig_yaml(kGood + "name: " + name + "\n", "my.yaml");
  };
  for (const char* good : {"plain", "\u00fcml\u00e4ut", "\u2026", "\U0001F697"})
    EXPECT_EQ(with_name(good).value().name, good);
  for (const char* bad : {"\x80", "\xC3", "\xC0\xAF", "\xE0\x80\xAF", "\xED\xA0\x80", "\xF4\x90\x80\x80", "\xFF"}) {
    const auto refused = with_name(bad);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message(), "my.yaml:13: not valid UTF-8");
  }
}

TEST(RigYaml, AMissingFileIsReported) {
  const auto rig = read_rig_yaml("/nonexistent/rig.yaml");
  ASSERT_FALSE(rig);
  EXPECT_EQ(rig.error().code, ErrorCode::configuration);
  EXPECT_THAT(rig.error().message(), HasSubstr("/nonexistent/rig.yaml"));
}

// --- round trips of random rigs ---

double any_number() {
  return *rc::gen::map(rc::gen::inRange(-2000000000, 2000000000), [](int v) { return v / 3.7e7; });
}
double any_positive() {
  return 1e-3 + std::abs(any_number());
}

Pose any_pose() {
  const Eigen::Vector3d turn(any_number() / 20, any_number() / 20, any_number() / 20);
  return Pose(exp_so3(turn), {any_number(), any_number(), any_number()});
}

Camera any_camera(const std::string& name, bool on_mast) {
  Camera camera;
  camera.name = name;
  camera.size = {*rc::gen::inRange(1, 5000), *rc::gen::inRange(1, 5000)};
  const PinholeModel pinhole{any_positive(), any_positive(), any_number(), any_number()};
  RadialTangentialModel::Coefficients k{};
  const std::size_t count = *rc::gen::element<std::size_t>(4, 5, 8);
  for (std::size_t i = 0; i < count; ++i) k[i] = any_number() / 100;
  camera.model = *rc::gen::arbitrary<bool>() ? CameraModel(pinhole) : CameraModel(RadialTangentialModel(pinhole, k));
  camera.pixel_format.layout =
      *rc::gen::element(PixelLayout::gray, PixelLayout::rgb, PixelLayout::bayer_rggb, PixelLayout::bayer_gbrg,
                        PixelLayout::bayer_bggr, PixelLayout::bayer_grbg);
  camera.pixel_format.bits = *rc::gen::inRange(8, 17);
  camera.pixel_format.alignment = *rc::gen::element(BitAlignment::low, BitAlignment::high);
  camera.vignetting = *rc::gen::element(Vignetting(), Vignetting{{-0.3}, std::nullopt},
                                        Vignetting{{-0.3, 0.1 / 3, 1e-5}, Eigen::Vector2d(30.1, 1.0 / 3)});
  camera.self_mask = *rc::gen::element<std::string>("", "mask.png", "a \"b\": #c\n\\");
  camera.mount = on_mast ? "mast" : "body";
  camera.mount_from_camera = any_pose();
  return camera;
}

Rig any_rig() {
  Rig rig;
  rig.name = *rc::gen::element<std::string>("rover", "", "yes", "1.5", "with: colon", "ünïcode \t tab");
  rig.convention = *rc::gen::element(PoseConvention::body, PoseConvention::left_optical);
  rig.pan_tilt_units = {{"mast", any_pose(), any_number(), any_number()}};
  const int pairs = *rc::gen::inRange(1, 4);
  for (int i = 0; i < pairs; ++i) {
    const std::string number = std::to_string(i);
    const bool on_mast = *rc::gen::arbitrary<bool>();
    rig.cameras.push_back(any_camera("left" + number, on_mast));
    rig.cameras.push_back(any_camera("right" + number, on_mast));
    rig.pairs.push_back(
        {"pair" + number, "left" + number, "right" + number, std::abs(any_number()), *rc::gen::arbitrary<bool>()});
  }
  return rig;
}

RC_GTEST_PROP(RigYaml, RoundTrips, ()) {
  const Rig rig = any_rig();
  RC_PRE(rig.validation_errors().empty());
  const auto read = parse_rig_yaml(to_rig_yaml(rig), "rig.yaml");
  if (!read) RC_FAIL(read.error().message() + "\n" + to_rig_yaml(rig));
  RC_ASSERT(*read == rig);
}

// A truncated file, or one with a changed byte, is either read or rejected.
RC_GTEST_PROP(RigYaml, SurvivesDamagedFiles, ()) {
  std::string text = testing::doc_example("rig.yaml");
  if (*rc::gen::arbitrary<bool>()) {
    text.resize(*rc::gen::inRange<std::size_t>(0, text.size()));
  } else {
    text[*rc::gen::inRange<std::size_t>(0, text.size())] = static_cast<char>(*rc::gen::inRange(0, 256));
  }
  const auto read = parse_rig_yaml(text, "rig.yaml");
  if (read) RC_ASSERT(read->validation_errors().empty());
  if (!read) RC_ASSERT(read.error().code == ErrorCode::configuration);
}

}  // namespace
}  // namespace spartan
