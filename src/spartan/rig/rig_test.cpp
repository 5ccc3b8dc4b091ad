#include "spartan/rig/rig.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace spartan {
namespace {

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Camera camera(const std::string& name, double y_m) {
  Camera made;
  made.name = name;
  made.size = {640, 480};
  made.model = PinholeModel{500, 500, 319.5, 239.5};
  made.mount_from_camera = Pose::from_translation({0.1, y_m, 0.05}) * optical_from_forward().inverse();
  return made;
}

Rig rig_on_mast() {
  Rig rig;
  rig.name = "rover";
  rig.pan_tilt_units = {{"mast", Pose::from_translation({0, 0, 1}), 0.1, 0.6}};
  rig.cameras = {camera("left", 0.1), camera("right", -0.1)};
  for (Camera& c : rig.cameras) c.mount = "mast";
  rig.pairs = {{"wide", "left", "right"}};
  return rig;
}

// The keys of all errors after a change.
template <class Change>
std::vector<std::string> faults_after(Change change) {
  Rig rig = rig_on_mast();
  change(rig);
  std::vector<std::string> keys;
  for (const RigValidationError& fault : rig.validation_errors()) keys.push_back(fault.key);
  return keys;
}
using Keys = std::vector<std::string>;

TEST(Rig, ValidRigHasNoFaults) {
  EXPECT_EQ(faults_after([](Rig&) {}), Keys{});
  EXPECT_TRUE(rig_on_mast().validate("rig.yaml"));
}

TEST(Rig, EveryKindOfFaultIsFound) {
  EXPECT_EQ(faults_after([](Rig& r) { r.pairs.clear(); }), Keys{"pairs"});
  EXPECT_EQ(faults_after([](Rig& r) { r.pairs[0].left = "top"; }), Keys{"pairs.wide.left"});
  EXPECT_EQ(faults_after([](Rig& r) { r.pairs[0].right = "left"; }), Keys{"pairs.wide.right"});
  EXPECT_EQ(faults_after([](Rig& r) { r.pairs[0].nearest_m = -1; }), Keys{"pairs.wide.nearest_m"});
  EXPECT_EQ(faults_after([](Rig& r) { r.pairs[0].nearest_m = kNan; }), Keys{"pairs.wide.nearest_m"});
  EXPECT_EQ(faults_after([](Rig& r) { r.pairs.push_back(r.pairs[0]); }), Keys{"pairs.wide"});
  EXPECT_EQ(faults_after([](Rig& r) { r.cameras[1].mount = "body"; }), Keys{"pairs.wide"});
  EXPECT_EQ(faults_after([](Rig& r) { r.cameras[1].mount_from_camera = r.cameras[0].mount_from_camera; }),
            Keys{"pairs.wide"});
  EXPECT_EQ(faults_after([](Rig& r) { r.cameras[0].size = {0, 480}; }), Keys{"cameras.left.size_px"});
  EXPECT_EQ(faults_after([](Rig& r) { r.cameras[0].size = {1, 480}; }), Keys{"cameras.left.size_px"});
  EXPECT_EQ(faults_after([](Rig& r) { r.cameras[0].size = {640, 1}; }), Keys{"cameras.left.size_px"});
  EXPECT_EQ(faults_after([](Rig& r) { r.cameras[0].size = {2, 2}; }), Keys{});
  EXPECT_EQ(faults_after([](Rig& r) { r.cameras[0].size = {40000, 480}; }), Keys{"cameras.left.size_px"});
  EXPECT_EQ(faults_after([](Rig& r) {
              r.cameras[0].model = PinholeModel{0, 500, 0, 0};
            }),
            Keys{"cameras.left.focal_px"});
  EXPECT_EQ(faults_after([](Rig& r) {
              r.cameras[0].model = PinholeModel{500, -1, 0, 0};
            }),
            Keys{"cameras.left.focal_px"});
  EXPECT_EQ(faults_after([](Rig& r) {
              r.cameras[0].model = PinholeModel{500, 500, kNan, 0};
            }),
            Keys{"cameras.left.centre_px"});
  EXPECT_EQ(faults_after([](Rig& r) {
              r.cameras[0].model = CahvorModel({}, {0, 0, 1.01}, {0, 0.1, 0});
            }),
            Keys{"cameras.left.optical_axis"});
  EXPECT_EQ(faults_after([](Rig& r) {
              r.cameras[0].model = DoubleSphereModel{{}, 0, -0.1};
            }),
            Keys{"cameras.left.alpha"});
  EXPECT_EQ(faults_after([](Rig& r) { r.cameras[0].pixel_format.bits = 17; }), Keys{"cameras.left.bits"});
  EXPECT_EQ(faults_after([](Rig& r) {
              r.cameras[0].mount_from_camera = Pose::from_translation({kNan, 0, 0});
            }),
            Keys{"cameras.left"});
  EXPECT_EQ(faults_after([](Rig& r) { r.pan_tilt_units[0].rest_tilt_rad = kNan; }),
            Keys{"pan_tilt_units.mast.rest_angles_rad"});
  EXPECT_EQ(faults_after([](Rig& r) { r.pan_tilt_units[0].name = "arm"; }),
            (Keys{"cameras.left.mount", "cameras.right.mount"}));
  EXPECT_EQ(faults_after([](Rig& r) { r.cameras.push_back(r.cameras[0]); }), Keys{"cameras.left"});
  // Names are used as folders.
  EXPECT_EQ(faults_after([](Rig& r) { r.pairs[0].name = "../up"; }), Keys{"pairs.../up"});
  EXPECT_EQ(faults_after([](Rig& r) { r.pairs[0].name = ""; }), Keys{"pairs."});
}

TEST(Rig, AllFaultsAreReportedAtOnce) {
  Rig rig = rig_on_mast();
  rig.cameras[0].size = {-1, 480};
  rig.pairs[0].right = "nobody";
  const Status status = rig.validate("my.yaml");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::configuration);
  EXPECT_THAT(status.error().message(), HasSubstr("my.yaml: cameras.left.size_px: is -1 × 480"));
  EXPECT_THAT(status.error().message(), HasSubstr("my.yaml: pairs.wide.right: there is no camera 'nobody'"));
}

// Pan to the left, then tilt down: calculated by hand for 90°.
TEST(Rig, PanAndTiltRotateCamerasOnTheMast) {
  const Rig rig = rig_on_mast();
  const double quarter = std::numbers::pi / 2;
  const Pose panned = rig.body_from_camera("left", quarter, 0);
  EXPECT_LE((panned.translation() - Eigen::Vector3d(-0.1, 0.1, 1.05)).norm(), 1e-12);
  EXPECT_LE((panned.rotation() * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitY()).norm(), 1e-12);
  const Pose tilted = rig.body_from_camera("left", 0, quarter);
  EXPECT_LE((tilted.translation() - Eigen::Vector3d(0.05, 0.1, 0.9)).norm(), 1e-12);
  EXPECT_LE((tilted.rotation() * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  // Rest angles by default.
  EXPECT_EQ(rig.body_from_camera("right").matrix(), rig.body_from_camera("right", 0.1, 0.6).matrix());
}

TEST(Rig, PanAndTiltKeepTheRelativePose) {
  const Rig rig = rig_on_mast();
  const Pose right_from_left = rig.right_from_left(rig.pairs[0]);
  for (const double pan : {-0.6, 0.0, 0.4}) {
    const Pose turned = rig.body_from_camera("right", pan, 0.7).inverse() * rig.body_from_camera("left", pan, 0.7);
    EXPECT_LE((turned.matrix() - right_from_left.matrix()).norm(), 1e-12);
  }
  EXPECT_LE((right_from_left.translation() - Eigen::Vector3d(-0.2, 0, 0)).norm(), 1e-12);
}

TEST(Rig, WithoutABodyFrameTheLeftCameraDefinesIt) {
  const Rig rig = rig_of_one_pair("front", camera("l", 5), camera("r", 6), Pose::from_translation({-0.3, 0.01, 0}));
  EXPECT_TRUE(rig.validate("rig"));
  EXPECT_EQ(rig.convention, PoseConvention::left_optical);
  const Pose body_from_left = rig.body_from_camera("l");
  EXPECT_LE(body_from_left.translation().norm(), 1e-15);
  EXPECT_LE((body_from_left.rotation() * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 1e-15);
  EXPECT_LE((body_from_left.rotation() * Eigen::Vector3d::UnitX() + Eigen::Vector3d::UnitY()).norm(), 1e-15);
  EXPECT_LE((rig.right_from_left(rig.pairs[0]).translation() - Eigen::Vector3d(-0.3, 0.01, 0)).norm(), 1e-15);
}

TEST(Rig, UnknownNamesAreProgrammingErrors) {
  const Rig rig = rig_on_mast();
  EXPECT_THROW(rig.body_from_camera("nobody"), std::invalid_argument);
  EXPECT_THROW(rig.right_from_left({"x", "left", "nobody"}), std::invalid_argument);
  EXPECT_EQ(rig.find_camera("nobody"), nullptr);
  EXPECT_EQ(rig.find_pair("nobody"), nullptr);
}

}  // namespace
}  // namespace spartan
