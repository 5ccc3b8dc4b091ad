#include "spartan/localization/internal/updates/motion_update.h"

#include <gtest/gtest.h>

#include "spartan/localization/internal/updates/started_memory_test.h"

namespace spartan::internal {
namespace {

RelativeMotion forward(double metres) {
  RelativeMotion m;
  m.from = start_stamp();
  m.to = after_start(1);
  m.measured = true;
  m.previous_from_current = Pose::from_translation({metres, 0, 0});
  m.covariance = test_motion_covariance();
  return m;
}

// Cameras alone, or predicted by an IMU that says 0.1 m with σ 1 mm.
FilterMemory at_the_next_frame(const LocalizationOptions& options, bool imu) {
  FilterMemory memory = started_memory(options, {imu, false, false, false});
  if (imu) {
    memory.stamp = after_start(1);
    memory.estimate.state.world_from_body = memory.estimate.state.world_from_body * Pose::from_translation({0.1, 0, 0});
    memory.estimate.covariance.diagonal().head<3>().setConstant(1e-6);
  } else {
    StatePropagation(options).propagate_to(memory, after_start(1), nullptr);
  }
  return memory;
}

double travelled(const FilterMemory& memory) {
  return (memory.estimate.state.world_from_body.translation()).norm();
}

TEST(MotionUpdate, WithoutAnImuThePoseFollows) {
  const LocalizationOptions options = test_options();
  FilterMemory memory = at_the_next_frame(options, false);
  MotionUpdate(options).update(memory, forward(0.2));
  EXPECT_NEAR(travelled(memory), 0.2, 1e-12);
  EXPECT_NEAR(memory.estimate.state.velocity_m_s.x(), 0.2, 1e-9);
  EXPECT_EQ(memory.vision.clone_stamp, after_start(1));
  EXPECT_LT(distance(memory.estimate.state.world_from_vision_clone, memory.estimate.state.world_from_body), 1e-12);
  EXPECT_EQ(memory.vision.constant_velocity_s, 0);
  EXPECT_FALSE(memory.monitor(LocalizationSensor::vision).test) << "there is no prediction to test against";
}

// σ of the motion 30 µm, of the prediction 1 mm.
TEST(MotionUpdate, WithAnImuThePredictionIsCorrected) {
  const LocalizationOptions options = test_options();
  FilterMemory memory = at_the_next_frame(options, true);
  MotionUpdate(options).update(memory, forward(0.102));
  EXPECT_NEAR(travelled(memory), 0.102, 1e-5);
  EXPECT_NEAR(variance_at(memory, 0), 9e-10, 1e-10);
  const SensorMonitor& monitor = memory.monitor(LocalizationSensor::vision);
  EXPECT_EQ(monitor.state, SensorState::ok);
  ASSERT_TRUE(monitor.test);
  EXPECT_NEAR(monitor.test->nis, 4, 0.1) << "2 mm, of σ 1 mm";
}

TEST(MotionUpdate, AWildMotionIsDoubtedUntilTheNextOne) {
  const LocalizationOptions options = test_options();
  FilterMemory memory = at_the_next_frame(options, true);
  const MotionUpdate motions(options);
  motions.update(memory, forward(0.6));
  EXPECT_TRUE(memory.vision.doubted);
  EXPECT_NEAR(travelled(memory), 0.1, 1e-9);
  ASSERT_TRUE(memory.monitor(LocalizationSensor::vision).test);
  EXPECT_GT(memory.monitor(LocalizationSensor::vision).test->nis, 1e5) << "0.5 m, of σ 1 mm";
  // The next one is contradicted, too: both were right.
  memory.stamp = after_start(2);
  memory.estimate.covariance.diagonal().head<3>().array() += 1e-6;
  RelativeMotion next = forward(0.6);
  next.from = after_start(1);
  next.to = after_start(2);
  motions.update(memory, next);
  EXPECT_FALSE(memory.vision.doubted);
  EXPECT_NEAR(travelled(memory), 1.2, 0.02);
  EXPECT_EQ(memory.monitor(LocalizationSensor::imu).state, SensorState::suspect);
  // It is used, and the IMU is what failed: its innovation is as it was measured, against the prediction by the IMU.
  for (const LocalizationSensor sensor : {LocalizationSensor::vision, LocalizationSensor::imu}) {
    ASSERT_TRUE(memory.monitor(sensor).test);
    EXPECT_GT(memory.monitor(sensor).test->nis, memory.monitor(sensor).test->gate) << name_of(sensor);
  }
}

TEST(MotionUpdate, ALostFrameKeepsItsReference) {
  const LocalizationOptions options = test_options();
  const MotionUpdate motions(options);
  for (const bool keeps : {true, false}) {
    FilterMemory memory = at_the_next_frame(options, false);
    RelativeMotion lost = forward(0);
    lost.measured = false;
    lost.keeps_reference = keeps;
    motions.update(memory, lost);
    EXPECT_EQ(memory.monitor(LocalizationSensor::vision).reason, HealthReason::lost);
    EXPECT_EQ(memory.vision.clone_stamp, keeps ? start_stamp() : after_start(1));
  }
}

TEST(MotionUpdate, DriftOfVisionChangesWhileTheRoverMoves) {
  LocalizationOptions options = test_options();
  options.vision.drift_sigma_ratios = {0.5, 0.5, 0.5, 0.5, 0.5, 0.5};
  for (const double metres : {0.0, 0.1}) {
    FilterMemory memory = at_the_next_frame(options, false);
    memory.estimate.state.vision_drift.setConstant(1);
    MotionUpdate(options).update(memory, forward(metres));
    EXPECT_EQ(memory.estimate.state.vision_drift[0] == 1, metres == 0);
    EXPECT_EQ(memory.vision.stationary, metres == 0);
  }
}

}  // namespace
}  // namespace spartan::internal
