// The rigs in config/rigs have the documented properties (docs/architecture.md; published values of the rover).
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/rig/describe.h"
#include "spartan/testing/real_data.h"

namespace spartan {
namespace {

Rig shipped(const std::string& name) {
  return read_rig_yaml(testing::source_folder() + "/config/rigs/" + name + ".yaml").value();
}

// Distance from below the camera to the ground point on the ray of a pixel in the middle column; the ground is z = 0 of
// the body frame.
double ground_ahead_m(const Rig& rig, const std::string& camera, double row) {
  const Camera& c = *rig.find_camera(camera);
  const Pose body_from_camera = rig.body_from_camera(camera);
  const Ray ray = unproject(c.model, {0.5 * (c.size.width - 1), row}).value();
  const Eigen::Vector3d direction = body_from_camera.rotation() * ray.direction;
  return -direction.x() / direction.z() * body_from_camera.translation().z();
}

void expect_view(const Rig& rig, const std::string& camera, double near_m, double far_m) {
  const double height = rig.find_camera(camera)->size.height;
  EXPECT_NEAR(ground_ahead_m(rig, camera, height - 0.5), near_m, 0.0005) << camera;
  EXPECT_NEAR(ground_ahead_m(rig, camera, -0.5), far_m, 0.0005) << camera;
}

void expect_pair(const Rig& rig, const std::string& name, double baseline_m, double hfov_deg, double vfov_deg) {
  const StereoPair& pair = *rig.find_pair(name);
  const PairSummary summary = summarize_pair(rig, pair);
  EXPECT_NEAR(summary.baseline_m, baseline_m, 1e-12) << name;
  EXPECT_NEAR(summary.hfov_deg, hfov_deg, 0.001) << name;
  EXPECT_NEAR(summary.vfov_deg, vfov_deg, 0.001) << name;
  const Eigen::Vector3d right_in_left = rig.right_from_left(pair).inverse().translation();
  EXPECT_LE((right_in_left - Eigen::Vector3d(baseline_m, 0, 0)).norm(), 1e-12) << name;
}

TEST(ShippedRigs, RoverHasThePublishedValues) {
  for (const char* name : {"rover", "rover_narrow1024"}) {
    SCOPED_TRACE(name);
    const Rig rig = shipped(name);
    EXPECT_EQ(rig.name, name);
    expect_pair(rig, "wide", 0.20, 50, 50);
    expect_pair(rig, "narrow", 0.12, 66, 49.5);
    expect_view(rig, "wide_left", 0.488, 4.011);
    expect_view(rig, "narrow_left", 0.200, 2.516);
    EXPECT_FALSE(rig.find_pair("wide")->for_odometry);
    EXPECT_TRUE(rig.find_pair("narrow")->for_odometry);
    EXPECT_NEAR(summarize_pair(rig, *rig.find_pair("wide")).focal_px, 1200.9, 0.05);
  }
  EXPECT_EQ(shipped("rover").find_camera("narrow_left")->size, (ImageSize{640, 480}));
  EXPECT_EQ(shipped("rover_narrow1024").find_camera("narrow_left")->size, (ImageSize{1024, 768}));
}

TEST(ShippedRigs, TheMastRotatesTheWidePair) {
  const Rig rig = shipped("rover");
  const double pan = 35 * std::numbers::pi / 180, tilt = 39 * std::numbers::pi / 180;
  const Eigen::Vector3d look = rig.body_from_camera("wide_left", pan, tilt).rotation() * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(std::atan2(look.y(), look.x()), pan, 1e-12) << "a positive pan looks to the left";
  EXPECT_NEAR(std::asin(-look.z()), tilt, 1e-12);
  EXPECT_EQ(rig.body_from_camera("narrow_left", pan, tilt).translation(),
            rig.body_from_camera("narrow_left").translation());
}

TEST(ShippedRigs, RealRigsEqualTheirOriginalFiles) {
  const std::string data = testing::data_folder();
  if (!std::filesystem::exists(data + "/k10_pair"))
    GTEST_SKIP() << "no real recordings; SPARTAN_DATA says where they are";
  for (const auto& [name, source] : {std::pair{"kitti", "kitti_06"}, {"euroc", "euroc_v101"}, {"k10", "k10_pair"}}) {
    const auto read = read_rig(data + "/" + source);
    ASSERT_TRUE(read) << read.error().message();
    for (const RigDifference& each : describe_differences(shipped(name), *read)) {
      EXPECT_EQ(each.key, "name") << each.text << " in " << name;
    }
  }
}

TEST(ShippedRigs, EveryShippedRigIsValid) {
  int read = 0;
  for (const auto& entry : std::filesystem::directory_iterator(testing::source_folder() + "/config/rigs")) {
    const auto rig = read_rig(entry.path().string());
    ASSERT_TRUE(rig) << rig.error().message();
    EXPECT_EQ(rig->name, entry.path().stem().string());
    ++read;
  }
  EXPECT_GE(read, 3);
  expect_pair(shipped("generic_pair"), "front", 0.12, 65.2385, 51.2822);
}

}  // namespace
}  // namespace spartan
