// Cameras at their optical axis, where the formulas divide by zero, and comparison of cameras.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "spartan/rig/models/camera_model.h"
#include "spartan/rig/rig.h"

namespace spartan {
namespace {

const PinholeModel kAxisPinhole{400, 405, 320, 240};
const CahvModel kAxisCahv{kAxisPinhole, 0.2};

// One camera of each model, and variants that differ from it in one parameter each.
std::vector<std::vector<CameraModel>> cameras_and_variants() {
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ(), tilted = Eigen::Vector3d(0.01, 0, 1).normalized();
  const PinholeModel other{401, 405, 320, 240};
  return {
      {kAxisPinhole, other, PinholeModel{400, 406, 320, 240}, PinholeModel{400, 405, 321, 240},
       PinholeModel{400, 405, 320, 241}},
      {RadialTangentialModel(kAxisPinhole, {0.1, 0.01}), RadialTangentialModel(other, {0.1, 0.01}),
       RadialTangentialModel(kAxisPinhole, {0.1, 0.02})},
      {EquidistantModel(kAxisPinhole, {0.1, 0.01}), EquidistantModel(other, {0.1, 0.01}),
       EquidistantModel(kAxisPinhole, {0.1, 0.02})},
      {DoubleSphereModel{kAxisPinhole, 0.1, 0.5}, DoubleSphereModel{other, 0.1, 0.5},
       DoubleSphereModel{kAxisPinhole, 0.2, 0.5}, DoubleSphereModel{kAxisPinhole, 0.1, 0.6}},
      {kAxisCahv, CahvModel{other, 0.2}, CahvModel{kAxisPinhole, 0.3}},
      {CahvorModel(kAxisCahv, z, {0, 0.1, 0}), CahvorModel({other, 0.2}, z, {0, 0.1, 0}),
       CahvorModel(kAxisCahv, tilted, {0, 0.1, 0}), CahvorModel(kAxisCahv, z, {0, 0.2, 0})},
      {CahvoreModel(kAxisCahv, z, {0, 0.1, 0}, {0, 0, 0}, 0.5),
       CahvoreModel({other, 0.2}, z, {0, 0.1, 0}, {0, 0, 0}, 0.5),
       CahvoreModel(kAxisCahv, tilted, {0, 0.1, 0}, {0, 0, 0}, 0.5),
       CahvoreModel(kAxisCahv, z, {0, 0.2, 0}, {0, 0, 0}, 0.5),
       CahvoreModel(kAxisCahv, z, {0, 0.1, 0}, {0.01, 0, 0}, 0.5),
       CahvoreModel(kAxisCahv, z, {0, 0.1, 0}, {0, 0, 0}, 0.6)},
  };
}

TEST(CameraModel, EveryParameterIsCompared) {
  for (const auto& variants : cameras_and_variants()) {
    for (std::size_t i = 0; i < variants.size(); ++i) {
      for (std::size_t k = 0; k < variants.size(); ++k) {
        EXPECT_EQ(variants[i] == variants[k], i == k) << name_of(variants[i]) << " " << i << " " << k;
      }
    }
  }
}

TEST(CameraModel, TheOpticalAxisIsARay) {
  for (const auto& variants : cameras_and_variants()) {
    for (const CameraModel& model : variants) {
      SCOPED_TRACE(name_of(model));
      const auto pixel = project(model, 2 * Eigen::Vector3d::UnitZ());
      ASSERT_TRUE(pixel);
      const auto ray = unproject(model, *pixel);
      ASSERT_TRUE(ray);
      EXPECT_LE((ray->direction - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
      EXPECT_LE(ray->origin.norm(), 1e-3);
    }
  }
}

// O = A: the pixel of the axis is exact, so the ray is the axis itself, without a direction across it.
TEST(CameraModel, ThePixelOfACentredAxisGivesTheAxis) {
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const Eigen::Vector2d centre(kAxisPinhole.cx, kAxisPinhole.cy);
  const std::vector<CameraModel> models{CahvorModel({kAxisPinhole, 0}, z, {0.01, 0.1, 0}),
                                        CahvoreModel({kAxisPinhole, 0}, z, {0.01, 0.1, 0}, {0.01, 0, 0}, 0.3),
                                        EquidistantModel(kAxisPinhole, {0.1}),
                                        RadialTangentialModel(kAxisPinhole, {0.1})};
  for (const CameraModel& model : models) {
    const auto ray = unproject(model, centre);
    ASSERT_TRUE(ray) << name_of(model);
    EXPECT_EQ(ray->direction, z) << name_of(model);
    EXPECT_EQ(ray->origin, Eigen::Vector3d(0, 0, 0)) << name_of(model);
  }
}

std::vector<std::string> faults_of_unit(const PanTiltUnit& unit) {
  Camera left;
  left.name = "left";
  left.size = {640, 480};
  left.model = kAxisPinhole;
  left.mount = unit.name;
  Camera right = left;
  right.name = "right";
  right.mount_from_camera = Pose::from_translation({0.2, 0, 0});
  Rig rig;
  rig.name = "rover";
  rig.pan_tilt_units = {unit};
  rig.cameras = {left, right};
  rig.pairs = {{"wide", "left", "right"}};
  std::vector<std::string> keys;
  for (const RigValidationError& fault : rig.validation_errors()) keys.push_back(fault.key);
  return keys;
}

TEST(PanTiltUnits, AreValidated) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  using Keys = std::vector<std::string>;
  EXPECT_EQ(faults_of_unit({"mast", Pose(), 0.1, 0.6}), Keys{});
  EXPECT_EQ(faults_of_unit({"mast", Pose(), kInfinity, 0.6}), Keys{"pan_tilt_units.mast.rest_angles_rad"});
  EXPECT_EQ(faults_of_unit({"mast", Pose(), 0.1, -kInfinity}), Keys{"pan_tilt_units.mast.rest_angles_rad"});
  EXPECT_EQ(faults_of_unit({"mast", Pose::from_unit_quaternion({2, 0, 0, 0}, Eigen::Vector3d::Zero()), 0, 0}),
            Keys{"pan_tilt_units.mast"});
  EXPECT_EQ(faults_of_unit({"mast", Pose::from_translation({2e9, 0, 0}), 0, 0}), Keys{"pan_tilt_units.mast"});
  EXPECT_THAT(faults_of_unit({"body", Pose(), 0, 0}), ::testing::Contains("pan_tilt_units.body"));
}

}  // namespace
}  // namespace spartan
