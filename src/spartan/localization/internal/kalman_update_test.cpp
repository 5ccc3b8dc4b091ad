#include "spartan/localization/internal/kalman_update.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "spartan/localization/internal/drive_test.h"

namespace spartan {
namespace {

Belief random_belief(Random& random, double sigma) {
  Belief belief;
  belief.state = random_navigation_state(random);
  ErrorCovariance root;
  for (Eigen::Index i = 0; i < root.size(); ++i) root.data()[i] = random.normal(0, sigma);
  belief.covariance = root * root.transpose();
  return belief;
}

TEST(KalmanUpdate, IsTheInformationFormOnLinearParts) {
  Random random(1);
  Belief belief = random_belief(random, 0.1);
  const Belief before = belief;
  Innovation i(3);
  i.residual << 0.1, -0.2, 0.3;
  for (int row = 0; row < 3; ++row) {
    for (int column = error_at::kVelocity; column < error_at::kVisionClone; ++column)
      i.jacobian(row, column) = random.normal();
  }
  i.noise.diagonal() << 0.5, 0.7, 0.9;
  ASSERT_TRUE(correct(belief, i));
  const ErrorCovariance information =
      before.covariance.inverse() + i.jacobian.transpose() * i.noise.inverse() * i.jacobian;
  const ErrorCovariance expected = information.inverse();
  const ErrorVector step = expected * (i.jacobian.transpose() * i.noise.inverse() * i.residual);
  EXPECT_LE((error_between(before.state, belief.state) - step).norm(), 1e-7);
  // Poses aside, whose errors are carried over to the new mean.
  const ErrorCovariance off = belief.covariance - expected;
  EXPECT_LE((off.block<27, 27>(error_at::kVelocity, error_at::kVelocity)).cwiseAbs().maxCoeff(), 1e-7);
  const Matrix6d reset = right_jacobian_se3(step.head<6>());
  const Matrix6d carried = reset * expected.topLeftCorner<6, 6>() * reset.transpose();
  EXPECT_LE((belief.covariance.topLeftCorner<6, 6>() - carried).norm(), 1e-7);
}

// The noise as one more error beside the others: where the belief knows their covariance there is nothing shared.
TEST(KalmanUpdate, NoiseThatSharesTheErrorIsThatOfAnAugmentedState) {
  Random random(5);
  Belief belief = random_belief(random, 0.1);
  const Belief before = belief;
  constexpr int kNoise = error_at::kWheelScale;  // plays the noise
  Innovation augmented(1), shared(1);
  augmented.residual[0] = shared.residual[0] = 0.2;
  augmented.jacobian(0, error_at::kVelocity) = shared.jacobian(0, error_at::kVelocity) = 2;
  augmented.jacobian(0, kNoise) = 1;
  shared.noise(0, 0) = before.covariance(kNoise, kNoise);
  shared.shared = before.covariance.col(kNoise);
  EXPECT_NEAR(normalised_square(before.covariance, shared), normalised_square(before.covariance, augmented), 1e-9);
  Belief expected = before;
  ASSERT_TRUE(correct(expected, augmented));
  ASSERT_TRUE(correct(belief, shared));
  EXPECT_LE(error_between(expected.state, belief.state).norm(), 1e-9);
  EXPECT_LE((expected.covariance - belief.covariance).norm(), 1e-9 * expected.covariance.norm());
}

TEST(KalmanUpdate, StatisticIsThatOfTheWholeCovariance) {
  Random random(2);
  const Belief belief = random_belief(random, 0.3);
  Innovation i(2);
  i.residual << 1, 2;
  i.jacobian(0, 7) = 1;
  i.jacobian(1, 30) = 2;
  i.noise << 0.3, 0.1, 0.1, 0.4;
  const Eigen::Matrix2d s = i.jacobian * belief.covariance * i.jacobian.transpose() + i.noise;
  EXPECT_NEAR(normalised_square(belief.covariance, i), i.residual.dot(s.inverse() * i.residual), 1e-9);
}

TEST(KalmanUpdate, OnlyTheChosenErrorLearnsAndTheOthersAreConsidered) {
  Random random(4);
  Belief belief = random_belief(random, 0.1);
  const Belief before = belief;
  Innovation i(1);
  i.residual[0] = 0.2;
  i.jacobian(0, error_at::kWheelScale) = 1;
  i.jacobian(0, error_at::kVelocity) = 2;
  i.noise(0, 0) = 0.3;
  ASSERT_TRUE(correct_only(belief, i, error_at::kWheelScale));
  ErrorVector moved = error_between(before.state, belief.state);
  EXPECT_GT(std::abs(moved[error_at::kWheelScale]), 1e-3);
  moved[error_at::kWheelScale] = 0;
  EXPECT_LE(moved.norm(), 1e-12);
  // Schmidt: the variance falls by what the optimal gain of this row is worth; the others keep theirs.
  const double s = (i.jacobian * before.covariance * i.jacobian.transpose() + i.noise)(0, 0);
  const double with = before.covariance.row(error_at::kWheelScale).dot(i.jacobian.row(0));
  EXPECT_NEAR(belief.covariance(error_at::kWheelScale, error_at::kWheelScale),
              before.covariance(error_at::kWheelScale, error_at::kWheelScale) - with * with / s, 1e-9);
  EXPECT_NEAR(belief.covariance(error_at::kVelocity, error_at::kVelocity),
              before.covariance(error_at::kVelocity, error_at::kVelocity), 1e-9);
}

TEST(KalmanUpdate, WhatIsOnlyConsideredStaysAndTheRestLearns) {
  Random random(4);
  Belief belief = random_belief(random, 0.1), whole = belief;
  const Belief before = belief;
  Innovation i(1);
  i.residual[0] = 0.2;
  i.jacobian(0, error_at::kVelocity) = 2;
  i.noise(0, 0) = 0.3;
  ASSERT_TRUE(correct_all_but(belief, i, error_at::kVisionDrift, 12));
  ASSERT_TRUE(correct(whole, i));
  const ErrorVector moved = error_between(before.state, belief.state), all = error_between(before.state, whole.state);
  EXPECT_EQ(moved.segment(error_at::kVisionDrift, 12).norm(), 0);
  EXPECT_GT(all.segment(error_at::kVisionDrift, 12).norm(), 1e-3);
  EXPECT_LE((moved - all).head<error_at::kVisionDrift>().norm(), 1e-12);
  EXPECT_GE(belief.covariance.trace(), whole.covariance.trace()) << "the optimal gain leaves least";
}

TEST(KalmanUpdate, LeavesABeliefAloneThatItCannotCorrect) {
  Random random(3);
  Belief belief = random_belief(random, 0.3);
  const Belief before = belief;
  Innovation i(1);
  i.residual[0] = 1;
  i.noise(0, 0) = -1e9;
  EXPECT_FALSE(correct(belief, i));
  EXPECT_TRUE(std::isinf(normalised_square(belief.covariance, i)));
  EXPECT_LE(error_between(before.state, belief.state).norm(), 1e-14);
  EXPECT_EQ((before.covariance - belief.covariance).norm(), 0);
}

}  // namespace
}  // namespace spartan
