#include "spartan/odometry/internal/motion_prediction.h"

#include <gtest/gtest.h>

#include <cmath>

namespace spartan::internal {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

OdometerMemory moving(double x_m) {
  OdometerMemory memory;
  memory.reference.stamp.ns = 10 * kSecond;
  memory.latest_velocity.motion[0] = x_m;
  memory.latest_velocity.span_s = 1;
  memory.steady_velocity = memory.latest_velocity;
  return memory;
}

double x_of(const Pose& pose) {
  return pose.translation().x();
}

TEST(MotionPrediction, IsTheLatestMotionScaledToTheTime) {
  const OdometerMemory memory = moving(0.2);
  EXPECT_NEAR(x_of(predict_motion(memory, {}, {11 * kSecond}).motion), 0.2, 1e-12);
  EXPECT_NEAR(x_of(predict_motion(memory, {}, {10 * kSecond + kSecond / 2}).motion), 0.1, 1e-12);
}

TEST(MotionPrediction, IsAtMostTwoMotionsOverAGapBetweenStamps) {
  const MotionPrediction prediction = predict_motion(moving(0.2), {}, {110 * kSecond});
  EXPECT_NEAR(x_of(prediction.motion), 0.4, 1e-12);
  EXPECT_TRUE(prediction.over_gap);
  ASSERT_EQ(prediction.other_starts.size(), 2U);
  EXPECT_NEAR(x_of(prediction.other_starts[0]), 0.2, 1e-12);
  EXPECT_NEAR(x_of(prediction.other_starts[1]), 20, 1e-9);
}

// A motion of few landmarks is uncertain.
TEST(MotionPrediction, TheLatestSteadyMotionIsAnotherStart) {
  OdometerMemory memory = moving(0.2);
  memory.latest_velocity.motion[0] = 0.5;
  const MotionPrediction prediction = predict_motion(memory, {}, {11 * kSecond});
  EXPECT_NEAR(x_of(prediction.motion), 0.5, 1e-12);
  EXPECT_NEAR(x_of(prediction.other_starts.back()), 0.2, 1e-12);
}

TEST(MotionPrediction, GoesOnFromALostFrame) {
  OdometerMemory memory = moving(0.2);
  memory.frames_since_reference = 3;
  memory.latest.stamp.ns = 13 * kSecond;
  memory.reference_from_latest = Pose::from_translation({0.6, 0, 0});
  const MotionPrediction prediction = predict_motion(memory, {}, {14 * kSecond});
  EXPECT_NEAR(x_of(prediction.motion), 0.8, 1e-12);
  EXPECT_NEAR(x_of(prediction.from(memory.reference_from_latest.inverse()).motion), 0.2, 1e-12);
}

TEST(MotionPrediction, TheCovarianceCoversThatTheRoverHasNotMoved) {
  const Matrix6d near = covariance_of_prediction(Pose()),
                 far = covariance_of_prediction(Pose(exp_so3({0, 0, 1}), {5, 0, 0}));
  EXPECT_DOUBLE_EQ(near(0, 0), 1);
  EXPECT_GT(std::sqrt(far(0, 0)), 5);
  EXPECT_GT(std::sqrt(far(5, 5)), 1);
}

}  // namespace
}  // namespace spartan::internal
