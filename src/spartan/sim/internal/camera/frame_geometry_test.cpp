#include "spartan/sim/internal/camera/frame_geometry.h"

#include <gtest/gtest.h>

#include <cmath>

#include "spartan/core/threads.h"
#include "spartan/testing/real_data.h"

namespace spartan::sim::internal {
namespace {

class FrameGeometryTest : public ::testing::Test {
 protected:
  FrameGeometryTest() {
    scenario_.path = {.kind = PathKind::straight, .length_m = 3, .speed_m_s = 0.1};
    scenario_.terrain.relief_m = scenario_.terrain.ripple_height_m = scenario_.terrain.dune_height_m = 0;
  }
  FrameGeometry geometry() const {
    const Drive drive = Drive::plan(scenario_.path, {}, rig_).value();
    const TerrainShape shape(scenario_.terrain, 1);
    return {rig_, scenario_, BodyMotion(drive, {shape, WheelLift()}, {}, ThreadPool(1))};
  }
  // x of a camera at the first or last row in the middle of the exposure.
  double x_of(const ShutterPoses& poses, bool last_row) const {
    const ExposurePoses at = poses.at(last_row ? 1 : 0);
    return 0.5 * (at[1].translation().x() + at[2].translation().x());
  }

  Rig rig_ = read_rig_yaml(testing::source_folder() + "/config/rigs/rover_square.yaml").value();
  Scenario scenario_;
  PlannedFrame frame_{15, "narrow", 3, 0, 0};
};

TEST_F(FrameGeometryTest, LateCamerasAreFartherAlongTheDrive) {
  const double on_time = x_of(geometry().exposing(frame_, "narrow_left", 0.01, {}).world_from_camera, false);
  scenario_.sensor.delay_ms = 30;
  scenario_.sensor.right_delay_ms = 20;
  const FrameGeometry late = geometry();
  EXPECT_NEAR(x_of(late.exposing(frame_, "narrow_left", 0.01, {}).world_from_camera, false) - on_time, 0.003, 1e-6);
  EXPECT_NEAR(x_of(late.exposing(frame_, "narrow_right", 0.01, {}).world_from_camera, false) - on_time, 0.005, 1e-6);
  const PairPoses pair = late.pair_poses(frame_, *rig_.find_pair("narrow"), {});
  EXPECT_NEAR(pair.world_from_left.at(0.3).translation().x() - on_time, 0.003, 1e-6);
  EXPECT_NEAR(pair.world_from_right.at(0.3).translation().x() - on_time, 0.005, 1e-6);
}

TEST_F(FrameGeometryTest, RollingShutterSpreadsTheRowsAroundTheStamp) {
  const double at_stamp = geometry().camera_pose(frame_, "narrow_left", frame_.time_s).translation().x();
  scenario_.sensor.rolling_shutter_ms = 40;
  const ShutterPoses poses = geometry().exposing(frame_, "narrow_left", 0.01, {}).world_from_camera;
  ASSERT_TRUE(poses.rolls);
  EXPECT_NEAR(x_of(poses, false) - at_stamp, -0.002, 1e-6);
  EXPECT_NEAR(x_of(poses, true) - at_stamp, 0.002, 1e-6);
  EXPECT_NEAR(poses.at(0.25)[0].translation().x() - at_stamp, -0.001 - 0.000375, 1e-6);
}

TEST_F(FrameGeometryTest, TheRoverIsThereOnlyWhereItIsVisible) {
  EXPECT_FALSE(geometry().visible_rover(frame_).has_value());
  scenario_.chassis.visible = true;
  EXPECT_TRUE(geometry().visible_rover(frame_).has_value());
}

}  // namespace
}  // namespace spartan::sim::internal
