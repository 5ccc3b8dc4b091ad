#include "spartan/localization/internal/kalman_update.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "spartan/localization/internal/drive_test.h"

namespace spartan::internal {
namespace {

StateEstimate random_estimate(Random& random, double sigma) {
  StateEstimate estimate;
  estimate.state = random_navigation_state(random);
  ErrorCovariance root;
  for (Eigen::Index i = 0; i < root.size(); ++i) root.data()[i] = random.normal(0, sigma);
  estimate.covariance = root * root.transpose();
  return estimate;
}

TEST(KalmanUpdate, EqualsTheInformationFormOnLinearParts) {
  Random random(1);
  StateEstimate estimate = random_estimate(random, 0.1);
  const StateEstimate before = estimate;
  Innovation i(3);
  i.residual << 0.1, -0.2, 0.3;
  for (int row = 0; row < 3; ++row) {
    for (int column = error_at::kVelocity; column < error_at::kVisionClone; ++column)
      i.jacobian(row, column) = random.normal();
  }
  i.noise.diagonal() << 0.5, 0.7, 0.9;
  ASSERT_TRUE(correct(estimate, i));
  const ErrorCovariance information =
      before.covariance.inverse() + i.jacobian.transpose() * i.noise.inverse() * i.jacobian;
  const ErrorCovariance expected = information.inverse();
  const ErrorVector step = expected * (i.jacobian.transpose() * i.noise.inverse() * i.residual);
  EXPECT_LE((error_between(before.state, estimate.state) - step).norm(), 1e-7);
  // Except poses, whose errors are transported to the new mean.
  const ErrorCovariance off = estimate.covariance - expected;
  EXPECT_LE((off.block<27, 27>(error_at::kVelocity, error_at::kVelocity)).cwiseAbs().maxCoeff(), 1e-7);
  const Matrix6d reset = right_jacobian_se3(step.head<6>());
  const Matrix6d transported = reset * expected.topLeftCorner<6, 6>() * reset.transpose();
  EXPECT_LE((estimate.covariance.topLeftCorner<6, 6>() - transported).norm(), 1e-7);
}

// Reference: a state augmented by the noise, whose cross-covariance is then part of the state covariance.
TEST(KalmanUpdate, CorrelatedNoiseEqualsAnAugmentedState) {
  Random random(5);
  StateEstimate estimate = random_estimate(random, 0.1);
  const StateEstimate before = estimate;
  constexpr int kNoise = error_at::kWheelScale;  // serves as the noise
  Innovation augmented(1), shared(1);
  augmented.residual[0] = shared.residual[0] = 0.2;
  augmented.jacobian(0, error_at::kVelocity) = shared.jacobian(0, error_at::kVelocity) = 2;
  augmented.jacobian(0, kNoise) = 1;
  shared.noise(0, 0) = before.covariance(kNoise, kNoise);
  shared.shared = before.covariance.col(kNoise);
  EXPECT_NEAR(normalized_innovation_squared(before.covariance, shared),
              normalized_innovation_squared(before.covariance, augmented), 1e-9);
  StateEstimate expected = before;
  ASSERT_TRUE(correct(expected, augmented));
  ASSERT_TRUE(correct(estimate, shared));
  EXPECT_LE(error_between(expected.state, estimate.state).norm(), 1e-9);
  EXPECT_LE((expected.covariance - estimate.covariance).norm(), 1e-9 * expected.covariance.norm());
}

TEST(KalmanUpdate, NormalizedInnovationSquaredUsesTheFullCovariance) {
  Random random(2);
  const StateEstimate estimate = random_estimate(random, 0.3);
  Innovation i(2);
  i.residual << 1, 2;
  i.jacobian(0, 7) = 1;
  i.jacobian(1, 30) = 2;
  i.noise << 0.3, 0.1, 0.1, 0.4;
  const Eigen::Matrix2d s = i.jacobian * estimate.covariance * i.jacobian.transpose() + i.noise;
  EXPECT_NEAR(normalized_innovation_squared(estimate.covariance, i), i.residual.dot(s.inverse() * i.residual), 1e-9);
}

TEST(KalmanUpdate, CorrectOnlyUpdatesOneErrorAndConsidersTheOthers) {
  Random random(4);
  StateEstimate estimate = random_estimate(random, 0.1);
  const StateEstimate before = estimate;
  Innovation i(1);
  i.residual[0] = 0.2;
  i.jacobian(0, error_at::kWheelScale) = 1;
  i.jacobian(0, error_at::kVelocity) = 2;
  i.noise(0, 0) = 0.3;
  ASSERT_TRUE(correct_only(estimate, i, error_at::kWheelScale));
  ErrorVector moved = error_between(before.state, estimate.state);
  EXPECT_GT(std::abs(moved[error_at::kWheelScale]), 1e-3);
  moved[error_at::kWheelScale] = 0;
  EXPECT_LE(moved.norm(), 1e-12);
  // Schmidt: the variance of this error decreases by the optimal gain of its row; the others keep theirs.
  const double s = (i.jacobian * before.covariance * i.jacobian.transpose() + i.noise)(0, 0);
  const double with = before.covariance.row(error_at::kWheelScale).dot(i.jacobian.row(0));
  EXPECT_NEAR(estimate.covariance(error_at::kWheelScale, error_at::kWheelScale),
              before.covariance(error_at::kWheelScale, error_at::kWheelScale) - with * with / s, 1e-9);
  EXPECT_NEAR(estimate.covariance(error_at::kVelocity, error_at::kVelocity),
              before.covariance(error_at::kVelocity, error_at::kVelocity), 1e-9);
}

TEST(KalmanUpdate, CorrectAllButConsidersTheGivenErrors) {
  Random random(4);
  StateEstimate estimate = random_estimate(random, 0.1), whole = estimate;
  const StateEstimate before = estimate;
  Innovation i(1);
  i.residual[0] = 0.2;
  i.jacobian(0, error_at::kVelocity) = 2;
  i.noise(0, 0) = 0.3;
  ASSERT_TRUE(correct_all_but(estimate, i, error_at::kVisionDrift, 12));
  ASSERT_TRUE(correct(whole, i));
  const ErrorVector moved = error_between(before.state, estimate.state), all = error_between(before.state, whole.state);
  EXPECT_EQ(moved.segment(error_at::kVisionDrift, 12).norm(), 0);
  EXPECT_GT(all.segment(error_at::kVisionDrift, 12).norm(), 1e-3);
  EXPECT_LE((moved - all).head<error_at::kVisionDrift>().norm(), 1e-12);
  EXPECT_GE(estimate.covariance.trace(), whole.covariance.trace()) << "the optimal gain minimizes the trace";
}

TEST(KalmanUpdate, LeavesTheEstimateUnchangedIfSIsNotPositiveDefinite) {
  Random random(3);
  StateEstimate estimate = random_estimate(random, 0.3);
  const StateEstimate before = estimate;
  Innovation i(1);
  i.residual[0] = 1;
  i.noise(0, 0) = -1e9;
  EXPECT_FALSE(correct(estimate, i));
  EXPECT_TRUE(std::isinf(normalized_innovation_squared(estimate.covariance, i)));
  EXPECT_LE(error_between(before.state, estimate.state).norm(), 1e-14);
  EXPECT_EQ((before.covariance - estimate.covariance).norm(), 0);
}

}  // namespace
}  // namespace spartan::internal
