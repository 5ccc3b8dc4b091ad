#include "spartan/localization/internal/updates/filter_correction.h"

#include <gtest/gtest.h>

#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/internal/updates/started_memory_test.h"

namespace spartan::internal {
namespace {

// Somewhere on a drive: all states correlated, a pose of the odometry that differs from that in the world.
FilterMemory on_a_drive() {
  FilterMemory memory = started_memory(test_options(), {});
  Random random(5);
  memory.estimate.state = random_navigation_state(random);
  ErrorCovariance root;
  for (int i = 0; i < root.size(); ++i) root.data()[i] = random.normal(0, 0.01);
  memory.estimate.covariance = root * root.transpose();
  memory.world_from_odom = exp_se3((Vector6d() << 1, 2, 3, 0.1, 0.2, 0.3).finished());
  memory.vision.odom_from_clone = memory.world_from_odom.inverse() * memory.estimate.state.world_from_vision_clone;
  memory.step.odom_from_clone = memory.world_from_odom.inverse() * memory.estimate.state.world_from_step_clone;
  return memory;
}

// Moves the pose along x.
Innovation shift(double metres) {
  Innovation innovation(1);
  innovation.residual[0] = metres;
  innovation.jacobian(0, error_at::kPosition) = 1;
  innovation.noise(0, 0) = 1e-4;
  return innovation;
}

TEST(FilterCorrection, OfTheWorldKeepsTheOdometry) {
  for (const auto& correct_by : {correct_world, correct_by_map}) {
    const FilterMemory before = on_a_drive();
    FilterMemory after = before;
    correct_by(after, shift(0.02));
    EXPECT_GT(distance(after.estimate.state.world_from_body, before.estimate.state.world_from_body), 1e-3);
    EXPECT_LT(distance(odom_pose(after), odom_pose(before)), 1e-12);
  }
}

TEST(FilterCorrection, ByAMapDoesNotChangeTheDriftOfVision) {
  const FilterMemory before = on_a_drive();
  FilterMemory after = before;
  correct_by_map(after, shift(0.02));
  EXPECT_EQ(after.estimate.state.vision_drift, before.estimate.state.vision_drift);
  EXPECT_EQ(after.estimate.state.calibration, before.estimate.state.calibration);
  correct_world(after, shift(0.02));
  EXPECT_NE(after.estimate.state.vision_drift, before.estimate.state.vision_drift);
}

TEST(FilterCorrection, OfAMotionMovesTheOdometryByIt) {
  const FilterMemory before = on_a_drive();
  FilterMemory after = before;
  correct_motion(after, shift(0.02), error_at::kVisionClone);
  const Pose motion = motion_since_clone(after.estimate.state, error_at::kVisionClone).clone_from_body;
  EXPECT_LT(distance(odom_pose(after), before.vision.odom_from_clone * motion), 1e-12);
  EXPECT_GT(distance(odom_pose(after), odom_pose(before)), 1e-3);
}

TEST(FilterCorrection, OfAPredictionChangesPoseAndVelocityOnly) {
  const FilterMemory before = on_a_drive();
  FilterMemory after = before;
  correct_prediction(after, shift(0.02));
  const ErrorVector change = error_between(before.estimate.state, after.estimate.state);
  EXPECT_GT(change.head<9>().norm(), 1e-3);
  EXPECT_LT(change.tail<error_at::kSize - 9>().norm(), 1e-14);
}

TEST(FilterCorrection, CovarianceOfTheOdometryIsThatOfTheMotionsSoFar) {
  FilterMemory memory = started_memory(test_options(), {});
  memory.vision.odom_covariance = 4e-6 * Matrix6d::Identity();
  // At the clone itself there is no motion.
  EXPECT_LT((odom_from_imu(memory).covariance - memory.vision.odom_covariance).norm(), 1e-12);
  memory.estimate.covariance(0, 0) += 9e-6;  // of the pose, not of the clone
  EXPECT_NEAR(odom_from_imu(memory).covariance(0, 0), 13e-6, 1e-12);
}

}  // namespace
}  // namespace spartan::internal
