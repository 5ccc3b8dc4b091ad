#include "spartan/localization/internal/motion_composition.h"

#include <gtest/gtest.h>

#include "spartan/localization/internal/drive_test.h"
#include "spartan/localization/internal/propagation.h"

namespace spartan::internal {
namespace {

Matrix6d random_covariance(Random& random, double sigma) {
  Matrix6d a;
  for (Eigen::Index i = 0; i < a.size(); ++i) a.data()[i] = random.normal(0, sigma);
  return a * a.transpose() + sigma * sigma * Matrix6d::Identity();
}

StateEstimate random_estimate(Random& random) {
  StateEstimate e{random_navigation_state(random), {}};
  Eigen::Matrix<double, error_at::kSize, error_at::kSize> a;
  for (Eigen::Index i = 0; i < a.size(); ++i) a.data()[i] = random.normal(0, 1e-3);
  e.covariance = a * a.transpose();
  return e;
}

MotionErrors random_errors(Random& random) {
  MotionErrors errors;
  errors.drift = Vector6d::Constant(1e-3).asDiagonal();
  for (Eigen::Index i = 0; i < errors.by_calibration.size(); ++i)
    errors.by_calibration.data()[i] = random.normal(0, 1e-3);
  return errors;
}

// Oracle: the Kalman update of a prediction that equals the measurement and whose own noise is large.
TEST(MotionComposition, IsTheUpdateOfAPredictionWithoutWeight) {
  Random random(81);
  for (int round = 0; round < 5; ++round) {
    const StateEstimate before = random_estimate(random);
    const MotionErrors errors = random_errors(random);
    const Matrix6d covariance = random_covariance(random, 1e-3);
    const Pose measured = before.state.world_from_vision_clone.inverse() * before.state.world_from_body *
                          exp_se3(0.05 * Vector6d::Ones());
    StateEstimate composed = before;
    compose_motion(composed, measured, covariance, errors);

    StateEstimate predicted = before;
    predicted.state.world_from_body = composed.state.world_from_body;
    predicted.covariance.topLeftCorner<6, 6>() += 1e4 * Matrix6d::Identity();
    const Innovation innovation =
        relative_motion_innovation(predicted.state, error_at::kVisionClone, measured, covariance, errors);
    EXPECT_LT(innovation.residual.norm(), 1e-12);
    ASSERT_TRUE(correct(predicted, innovation));
    EXPECT_LT((predicted.covariance - composed.covariance).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_GT(composed.covariance.diagonal().head<6>().minCoeff(), 1e-6);
  }
}

// Oracle: the scatter of drawn errors.
TEST(MotionComposition, CovarianceIsThatOfDrawnErrors) {
  Random random(82);
  const StateEstimate before = random_estimate(random);
  const MotionErrors errors = random_errors(random);
  const Matrix6d covariance = random_covariance(random, 1e-3);
  const Pose measured = exp_se3((Vector6d() << 0.3, -0.1, 0.05, 0.1, 0.2, -0.3).finished());
  StateEstimate composed = before;
  compose_motion(composed, measured, covariance, errors);
  const ErrorCovariance root = before.covariance.llt().matrixL();
  const Matrix6d noise_root = covariance.llt().matrixL();
  Matrix6d scatter = Matrix6d::Zero();
  constexpr int kTrials = 20000;
  for (int trial = 0; trial < kTrials; ++trial) {
    ErrorVector e;
    for (double& x : e) x = random.normal();
    Vector6d n;
    for (double& x : n) x = random.normal();
    const NavigationState truth = add_error(before.state, root * e);
    const Pose end = truth.world_from_vision_clone * measured * exp_se3(lasting_error(truth, errors) + noise_root * n);
    const Vector6d error = log_se3(composed.state.world_from_body.inverse() * end);
    scatter += error * error.transpose() / kTrials;
  }
  const Matrix6d own = composed.covariance.topLeftCorner<6, 6>();
  EXPECT_LT((scatter - own).norm(), 0.05 * own.norm());
}

TEST(MotionComposition, VelocityIsThatOfTheConstantVelocityModel) {
  Random random(83);
  StateEstimate e = random_estimate(random);
  const Eigen::Vector3d rate(0.1, -0.05, 0.2);
  e.state.velocity_m_s = {0.3, 0.02, -0.01};
  const NavigationState end = propagate(e.state, ConstantVelocityStep{rate, 1.5});
  StateEstimate found = e;
  set_velocity(found, e.state.world_from_body.inverse() * end.world_from_body, 1.5, 0.01);
  EXPECT_LT((found.state.velocity_m_s - e.state.velocity_m_s).norm(), 0.02 * e.state.velocity_m_s.norm());
  EXPECT_EQ(found.covariance(error_at::kVelocity, error_at::kVelocity), 0.01);
  EXPECT_EQ(found.covariance.middleRows<3>(error_at::kVelocity).norm(), std::sqrt(3.0) * 0.01);
}

}  // namespace
}  // namespace spartan::internal
