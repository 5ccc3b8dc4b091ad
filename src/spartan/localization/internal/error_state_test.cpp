#include "spartan/localization/internal/error_state.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "spartan/localization/internal/drive_test.h"
#include "spartan/testing/numeric_jacobian.h"

namespace spartan::internal {
namespace {

TEST(ErrorState, ErrorBetweenInvertsAddError) {
  Random random(1);
  for (int round = 0; round < 20; ++round) {
    const NavigationState s = random_navigation_state(random);
    ErrorVector e;
    for (double& value : e) value = random.uniform(-0.5, 0.5);
    EXPECT_LE((error_between(s, add_error(s, e)) - e).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(ErrorState, EveryErrorChangesTheState) {
  Random random(2);
  const NavigationState s = random_navigation_state(random);
  for (int i = 0; i < error_at::kSize; ++i) {
    const NavigationState moved = add_error(s, 0.1 * ErrorVector::Unit(i));
    EXPECT_NEAR(error_between(s, moved).norm(), 0.1, 1e-9) << i;
  }
}

TEST(ErrorState, TrueUpMatchesTheTilt) {
  for (const Eigen::Vector2d& tilt : {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.1, -0.2), Eigen::Vector2d(-0.4, 0.3)}) {
    EXPECT_NEAR(true_up(tilt).norm(), 1, 1e-12);
    EXPECT_LE((tilt_of_up(true_up(tilt)) - tilt).norm(), 1e-12);
    const auto numeric =
        testing::numeric_jacobian<3, 2>([](const Eigen::Vector2d& t) -> Eigen::Vector3d { return true_up(t); }, tilt);
    EXPECT_LE((true_up_jacobian(tilt) - numeric).cwiseAbs().maxCoeff(), 1e-9);
  }
  // A tilt about x moves the vertical towards −y.
  EXPECT_LT(true_up({0.1, 0}).y(), 0);
}

TEST(ErrorState, CloneCopiesTheCorrelationsOfThePose) {
  Random random(3);
  StateEstimate estimate;
  estimate.state = random_navigation_state(random);
  ErrorCovariance root;
  for (Eigen::Index i = 0; i < root.size(); ++i) root.data()[i] = random.normal();
  const ErrorCovariance before = root * root.transpose();
  estimate.covariance = before;
  clone_pose(estimate, error_at::kStepClone);
  const ErrorCovariance& p = estimate.covariance;
  EXPECT_EQ(
      (p.block<6, 6>(error_at::kStepClone, error_at::kStepClone) - before.block<6, 6>(error_at::kPose, error_at::kPose))
          .norm(),
      0);
  EXPECT_EQ(
      (p.block<6, 6>(error_at::kStepClone, error_at::kPose) - before.block<6, 6>(error_at::kPose, error_at::kPose))
          .norm(),
      0);
  EXPECT_EQ((p.block<6, 3>(error_at::kStepClone, error_at::kGyroBias) -
             before.block<6, 3>(error_at::kPose, error_at::kGyroBias))
                .norm(),
            0);
  EXPECT_EQ((p.block<6, 6>(error_at::kVisionClone, error_at::kStepClone) -
             before.block<6, 6>(error_at::kVisionClone, error_at::kPose))
                .norm(),
            0);
  EXPECT_EQ((p - p.transpose()).norm(), 0);
  EXPECT_EQ((estimate.state.world_from_step_clone.matrix() - estimate.state.world_from_body.matrix()).norm(), 0);
}

}  // namespace
}  // namespace spartan::internal
