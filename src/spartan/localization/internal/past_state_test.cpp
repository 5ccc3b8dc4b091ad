// The past beside the present, against one Kalman filter over both.
#include "spartan/localization/internal/past_state.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "spartan/localization/internal/drive_test.h"
#include "spartan/localization/internal/propagation.h"

namespace spartan::internal {
namespace {

constexpr int kSize = error_at::kSize;
using Joint = Eigen::Matrix<double, 2 * kSize, 2 * kSize>;

Joint joint_of(const StateEstimate& e) {
  Joint j;
  j << e.past->covariance, e.past->with_present, e.past->with_present.transpose(), e.covariance;
  return j;
}

Eigen::MatrixXd random_matrix(Random& random, int rows, int cols) {
  Eigen::MatrixXd m(rows, cols);
  for (double& value : m.reshaped()) value = random.normal();
  return m;
}

/// With a past that has gone its own way.
StateEstimate estimate_with_past(Random& random) {
  StateEstimate e;
  e.state = random_navigation_state(random);
  const Eigen::MatrixXd root = random_matrix(random, 2 * kSize, 2 * kSize);
  const Joint joint = 1e-2 * root * root.transpose();
  e.covariance = joint.bottomRightCorner<kSize, kSize>();
  e.past.emplace();
  e.past->covariance = joint.topLeftCorner<kSize, kSize>();
  e.past->with_present = joint.topRightCorner<kSize, kSize>();
  return e;
}

/// The residual is so small that the poses need no transport to a new mean.
Innovation random_innovation(Random& random, int rows) {
  Innovation i(rows);
  i.residual = 1e-9 * random_matrix(random, rows, 1);
  i.jacobian = random_matrix(random, rows, kSize);
  const Eigen::MatrixXd root = random_matrix(random, rows, rows);
  i.noise = root * root.transpose();
  return i;
}

/// One update of past and present; `shared`: E[error of both · noiseᵀ].
void expect_joint_update(const StateEstimate& before, const StateEstimate& after, const Innovation& i,
                         const Eigen::MatrixXd& shared) {
  const Joint joint = joint_of(before);
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(i.rows(), 2 * kSize);
  h.rightCols<kSize>() = i.jacobian;
  const Eigen::MatrixXd with_residual = joint * h.transpose() + shared;
  const Eigen::MatrixXd s = h * with_residual + (h * shared).transpose() + i.noise;
  const Eigen::MatrixXd gain = s.llt().solve(with_residual.transpose()).transpose();
  const Joint expected = joint - gain * with_residual.transpose();
  const Eigen::VectorXd mean = gain * i.residual;
  EXPECT_LT((after.past->mean - mean.head<kSize>()).norm(), 1e-6 * mean.norm());
  EXPECT_LT((joint_of(after) - expected).norm(), 1e-6 * expected.norm());
}

TEST(PastState, IsCorrectedLikeTheJointState) {
  Random random(1, 1);
  for (const int rows : {1, 3, 6}) {
    const StateEstimate before = estimate_with_past(random);
    const Innovation i = random_innovation(random, rows);
    StateEstimate after = before;
    ASSERT_TRUE(correct(after, i));
    expect_joint_update(before, after, i, Eigen::MatrixXd::Zero(2 * kSize, rows));
  }
}

// The noise has something in common with the pose of the present, and through it with all other errors.
TEST(PastState, IsCorrectedByNoiseThatThePoseShares) {
  Random random(2, 1);
  const StateEstimate before = estimate_with_past(random);
  Innovation i = random_innovation(random, 3);
  const Eigen::MatrixXd of_pose = 0.05 * random_matrix(random, 6, 3);
  const Eigen::MatrixXd shared = joint_of(before).middleCols<6>(kSize + error_at::kPose) *
                                 before.covariance.block<6, 6>(error_at::kPose, error_at::kPose).ldlt().solve(of_pose);
  i.shared = shared.bottomRows<kSize>();
  StateEstimate after = before;
  ASSERT_TRUE(correct(after, i));
  expect_joint_update(before, after, i, shared);
}

// A gain that is not optimal: the covariances stay those of the errors that it makes.
TEST(PastState, KeepsTheCovariancesOfAnUpdateOfOneState) {
  Random random(3, 1);
  const StateEstimate before = estimate_with_past(random);
  const Innovation i = random_innovation(random, 2);
  StateEstimate after = before;
  ASSERT_TRUE(correct_only(after, i, error_at::kWheelScale));
  EXPECT_EQ((after.past->mean.array() != 0).count(), 1);
  // δ' = A δ − K v of both, with the gains that the means show.
  const Joint joint = joint_of(before);
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(2, 2 * kSize);
  h.rightCols<kSize>() = i.jacobian;
  const Eigen::MatrixXd s = h * joint * h.transpose() + i.noise;
  const Eigen::MatrixXd full = s.llt().solve((joint * h.transpose()).transpose()).transpose();
  Eigen::MatrixXd gain = Eigen::MatrixXd::Zero(2 * kSize, 2);
  for (const int row : {error_at::kWheelScale, kSize + error_at::kWheelScale}) gain.row(row) = full.row(row);
  const Eigen::MatrixXd keep = Joint::Identity() - gain * h;
  const Joint expected = keep * joint * keep.transpose() + gain * i.noise * gain.transpose();
  EXPECT_LT((joint_of(after) - expected).norm(), 1e-6 * expected.norm());
}

TEST(PastState, FollowsThePropagation) {
  Random random(4, 1);
  StateEstimate e = estimate_with_past(random);
  const StateEstimate before = e;
  const Transition t = transition(e.state, ConstantVelocityStep{{0.1, -0.2, 0.3}, 0.5}, {0.1, 0.2});
  propagate_covariance(e, t);
  ErrorCovariance f = ErrorCovariance::Identity();
  f.topLeftCorner<error_at::kMoving, error_at::kMoving>() = t.by_moving;
  f.block<error_at::kMoving, 4>(0, error_at::kGravityTilt) = t.by_constants;
  EXPECT_LT((e.past->with_present - before.past->with_present * f.transpose()).norm(), 1e-9);
  EXPECT_EQ(e.past->covariance, before.past->covariance);
}

TEST(PastState, FollowsACloneAndANewPast) {
  Random random(5, 1);
  StateEstimate e = estimate_with_past(random);
  clone_pose(e, error_at::kStepClone);
  EXPECT_EQ(e.past->with_present.middleCols<6>(error_at::kStepClone),
            e.past->with_present.middleCols<6>(error_at::kPose));
  begin_past(e);
  EXPECT_EQ(e.past->mean, ErrorVector::Zero());
  EXPECT_EQ(e.past->with_present, e.covariance);
  EXPECT_EQ(e.past->covariance, e.covariance);
}

}  // namespace
}  // namespace spartan::internal
