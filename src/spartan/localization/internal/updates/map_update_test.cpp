#include "spartan/localization/internal/updates/map_update.h"

#include <gtest/gtest.h>

#include "spartan/localization/internal/updates/started_memory_test.h"

namespace spartan::internal {
namespace {

// 10 mm along x and y.
FilterMemory uncertain_memory(const LocalizationOptions& options) {
  FilterMemory memory = started_memory(options, {});
  memory.estimate.covariance.diagonal().head<2>().setConstant(1e-4);
  clone_pose(memory.estimate, error_at::kVisionClone);
  return memory;
}

PoseConstraint constraint_at(double x, double sigma) {
  PoseConstraint c;
  c.stamp = start_stamp();
  c.world_from_body = Pose::from_translation({x, 0, 0});
  c.information(0, 0) = 1 / (sigma * sigma);
  return c;
}

TEST(MapUpdate, CorrectsThePoseAndKeepsTheOdometry) {
  LocalizationOptions options = test_options();
  options.map_factor = 4;
  FilterMemory memory = uncertain_memory(options);
  const Pose odom = odom_pose(memory);
  MapUpdate(options).update(memory, constraint_at(0.02, 0.005));  // σ² 1e-4 by the factor
  EXPECT_NEAR(memory.estimate.state.world_from_body.translation().x(), 0.01, 1e-8);
  EXPECT_NEAR(variance_at(memory, 0), 5e-5, 1e-10);
  EXPECT_LT(distance(odom_pose(memory), odom), 1e-12);
}

TEST(MapUpdate, IsThatOfTheBody) {
  LocalizationOptions options = test_options();
  options.imu.position_m = {0, 1, 0};
  FilterMemory memory = uncertain_memory(options);
  PoseConstraint c = constraint_at(0, 1e-6);
  c.information(1, 1) = c.information(0, 0);
  MapUpdate(options).update(memory, c);
  EXPECT_LT((memory.estimate.state.world_from_body.translation() - options.imu.position_m).norm(), 1e-6);
}

TEST(MapUpdate, RejectsAWrongMatch) {
  const LocalizationOptions options = test_options();
  FilterMemory memory = uncertain_memory(options);
  MapUpdate(options).update(memory, constraint_at(0.5, 0.005));
  EXPECT_EQ(memory.estimate.state.world_from_body.translation().x(), 0);
  EXPECT_EQ(memory.monitor(LocalizationSensor::map).state, SensorState::suspect);
}

TEST(MapUpdate, OfAnotherFrameIsIgnored) {
  const LocalizationOptions options = test_options();
  for (const bool same : {true, false}) {
    FilterMemory memory = uncertain_memory(options);
    LateConstraint late{after_start(1), constraint_at(0.02, 0.01)};
    if (!same) late.at_frame.stamp = after_start(-1);
    MapUpdate(options).update(memory, late);
    EXPECT_NEAR(memory.estimate.state.world_from_vision_clone.translation().x(), same ? 0.01 : 0, 1e-8);
  }
}

}  // namespace
}  // namespace spartan::internal
