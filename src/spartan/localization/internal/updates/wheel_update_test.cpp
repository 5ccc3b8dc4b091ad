#include "spartan/localization/internal/updates/wheel_update.h"

#include <gtest/gtest.h>

#include <cmath>

#include "spartan/localization/internal/updates/started_memory_test.h"
#include "spartan/localization/internal/updates/wheel_step.h"

namespace spartan::internal {
namespace {

LocalizationOptions wheel_options() {
  LocalizationOptions options = test_options();
  options.wheels.max_step_s = 1;
  options.wheels.track_m = 0.5;
  return options;
}

// Wheels at zero, one second after a frame that the filter has left with constant velocity.
FilterMemory one_second_later(const LocalizationOptions& options) {
  FilterMemory memory = started_memory(options, {false, true, false, false});
  StatePropagation(options).propagate_to(memory, after_start(1), nullptr);
  return memory;
}

WheelSample rolled(double seconds, double left_m, double right_m) {
  return {after_start(seconds), left_m, right_m};
}

TEST(WheelStep, CountsAreExtrapolatedForAMoment) {
  WheelMemory wheels;
  EXPECT_FALSE(wheels_at(wheels, after_start(0)));
  wheels.known = true;
  wheels.previous = rolled(0, 1, 2);
  wheels.last = rolled(0.2, 1.1, 2.2);
  EXPECT_NEAR(wheels_at(wheels, after_start(0.3))->left_m, 1.15, 1e-9);
  EXPECT_NEAR(wheels_at(wheels, after_start(0.3))->right_m, 2.3, 1e-9);
  EXPECT_FALSE(wheels_at(wheels, after_start(0.55))) << "more than one sample is missing";
}

TEST(WheelStep, ErrorsGrowWithTheDistance) {
  WheelOdometryOptions options;
  options.track_m = 0.5;
  const WheelStep step = step_between(rolled(0, 0, 0), rolled(1, 0.9, 1.1), options);
  EXPECT_DOUBLE_EQ(step.counted_m, 1);
  EXPECT_NEAR(step.yaw_rad, 0.4, 1e-12);
  EXPECT_NEAR(step.forward_sigma_m, std::hypot(options.min_sigma_m, options.forward_sigma_ratio), 1e-12);
  options.track_m = 0;
  EXPECT_FALSE(step_between(rolled(0, 0, 0), rolled(1, 0.9, 1.1), options).yaw_known);
}

TEST(WheelUpdate, PredictsThePoseBetweenFrames) {
  const LocalizationOptions options = wheel_options();
  FilterMemory memory = one_second_later(options);
  WheelUpdate(options).update(memory, rolled(1, 0.1, 0.1));
  EXPECT_NEAR(memory.estimate.state.world_from_body.translation().x(), 0.1, 0.01);
  EXPECT_TRUE(memory.vision.wheels_in_prediction);
  EXPECT_EQ(memory.step.from, after_start(1));
  // The odometry takes part in it.
  EXPECT_LT(distance(odom_pose(memory), memory.estimate.state.world_from_body), 1e-12);
}

TEST(WheelUpdate, WaitsForTheEndOfAStep) {
  LocalizationOptions options = wheel_options();
  options.wheels.max_step_s = 2;
  FilterMemory memory = one_second_later(options);
  WheelUpdate(options).update(memory, rolled(1, 0.1, 0.1));
  EXPECT_EQ(memory.step.from, start_stamp());
  WheelUpdate(options).end_step_at_frame(memory, after_start(1), false);
  EXPECT_EQ(memory.step.from, after_start(1));
  EXPECT_GT(memory.estimate.state.world_from_body.translation().x(), 0.05);
}

TEST(WheelUpdate, AStepThatIsPartOfAMeasuredMotionAddsNothing) {
  const LocalizationOptions options = wheel_options();
  for (const bool redundant : {false, true}) {
    FilterMemory memory = one_second_later(options);
    memory.wheels.previous = rolled(0.9, 0.09, 0.09);
    memory.wheels.last = rolled(1, 0.1, 0.1);
    memory.vision.wheels_in_prediction = redundant;
    WheelUpdate(options).end_step_at_frame(memory, after_start(1), true);
    EXPECT_EQ(memory.estimate.state.world_from_body.translation().x() == 0, redundant);
  }
}

// The pose is known: 1 − 0.04 / 0.1.
TEST(WheelUpdate, MeasuresTheSlip) {
  const LocalizationOptions options = wheel_options();
  FilterMemory memory = one_second_later(options);
  memory.estimate.covariance.setZero();
  memory.estimate.covariance.diagonal().setConstant(1e-8);
  memory.estimate.state.world_from_body = Pose::from_translation({0.04, 0, 0});
  WheelUpdate(options).update(memory, rolled(1, 0.1, 0.1));
  EXPECT_TRUE(memory.wheels.slip_known);
  EXPECT_NEAR(memory.wheels.slip, 0.6, 1e-6);
  EXPECT_NEAR(memory.wheels.slip_sigma, std::hypot(std::sqrt(2e-8), 0.001 * 0.4) / 0.1, 1e-5);
  EXPECT_EQ(memory.monitor(LocalizationSensor::wheels).reason, HealthReason::slips);
  EXPECT_NEAR(memory.estimate.state.world_from_body.translation().x(), 0.04, 1e-9) << "a step that slips is not used";
}

}  // namespace
}  // namespace spartan::internal
