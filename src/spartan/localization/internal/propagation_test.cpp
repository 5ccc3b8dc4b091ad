#include "spartan/localization/internal/propagation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "spartan/localization/internal/drive_test.h"
#include "spartan/testing/numeric_jacobian.h"

namespace spartan::internal {
namespace {
using MovingVector = Eigen::Matrix<double, error_at::kMoving, 1>;
using Full = Eigen::Matrix<double, error_at::kMoving, error_at::kSize>;

Full whole(const Transition& t) {
  Full f = Full::Zero();
  f.leftCols<error_at::kMoving>() = t.by_moving;
  f.middleCols<4>(error_at::kGravityTilt) = t.by_constants;
  return f;
}

template <class Step>
Full numeric(const NavigationState& s, const Step& move) {
  const NavigationState after = move(s);
  return testing::numeric_jacobian<error_at::kMoving, error_at::kSize>(
      [&](const ErrorVector& e) -> MovingVector {
        const ErrorVector difference = error_between(after, move(add_error(s, e)));
        return difference.head<error_at::kMoving>();
      },
      ErrorVector::Zero(), 1e-3);
}

InertialNoise noise_of(double gyro, double accel, double gyro_walk, double accel_walk) {
  return {Eigen::Vector3d::Constant(gyro), Eigen::Vector3d::Constant(accel), gyro_walk, accel_walk};
}

InertialStep random_step(Random& random) {
  return {normal3(random, 1), normal3(random, 1), normal3(random, 5), normal3(random, 5), random.uniform(0.002, 0.2)};
}

TEST(Propagation, InertialJacobianMatchesFiniteDifferences) {
  Random random(1);
  for (int round = 0; round < 10; ++round) {
    const NavigationState s = random_navigation_state(random);
    const InertialStep step = random_step(random);
    const Full differences = numeric(s, [&](const NavigationState& x) {
      // Readings that are taken later by the error of the clock.
      const double part = (x.imu_time_offset_s - s.imu_time_offset_s) / step.seconds;
      InertialStep later = step;
      later.gyro_from += part * (step.gyro_to - step.gyro_from),
          later.gyro_to += part * (step.gyro_to - step.gyro_from);
      later.accel_from += part * (step.accel_to - step.accel_from);
      later.accel_to += part * (step.accel_to - step.accel_from);
      return propagate(x, later, 3.71);
    });
    EXPECT_LE((whole(transition(s, step, {}, 3.71)) - differences).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(Propagation, ConstantVelocityJacobianMatchesFiniteDifferences) {
  Random random(2);
  for (int round = 0; round < 10; ++round) {
    const NavigationState s = random_navigation_state(random);
    const ConstantVelocityStep step{normal3(random, 0.5), random.uniform(0.01, 2)};
    const Full differences = numeric(s, [&](const NavigationState& x) { return propagate(x, step); });
    EXPECT_LE((whole(transition(s, step, ConstantVelocityNoise{})) - differences).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(Propagation, FollowsACircleInClosedForm) {
  // Speed v at rate w about z: radius v / w, centripetal force v w to the left.
  constexpr double v = 0.5, w = 0.4, g = 9.81, dt = 0.01;
  NavigationState s;
  s.velocity_m_s = {v, 0, 0};
  const Eigen::Vector3d gyro(0, 0, w), force(0, v * w, g);
  for (int i = 0; i < 500; ++i) s = propagate(s, InertialStep{gyro, gyro, force, force, dt}, g);
  const double angle = w * 5;
  const Eigen::Vector3d expected(v / w * std::sin(angle), v / w * (1 - std::cos(angle)), 0);
  EXPECT_LE((s.world_from_body.translation() - expected).norm(), 1e-4);
  EXPECT_LE(log_so3(s.world_from_body.rotation().conjugate() * exp_so3({0, 0, angle})).norm(), 1e-9);
}

TEST(Propagation, FollowsTheTestDrive) {
  const TestDrive drive;
  NavigationState s;
  s.world_from_body = drive.at(2);
  for (double t = 2; t < 20 - 1e-9; t += 0.01) {
    const ImuSample a = drive.imu(t), b = drive.imu(t + 0.01);
    s = propagate(s, InertialStep{a.gyro_rad_s, b.gyro_rad_s, a.accel_m_s2, b.accel_m_s2, 0.01}, 3.71);
  }
  EXPECT_LE((s.world_from_body.translation() - drive.at(20).translation()).norm(), 2e-3);
  EXPECT_LE((s.world_from_body.rotation() * s.velocity_m_s - drive.velocity(20)).norm(), 3e-4);
}

TEST(Propagation, ConstantVelocityMotionIsAnArc) {
  NavigationState s;
  s.velocity_m_s = {0.5, 0, 0};
  for (int i = 0; i < 500; ++i) s = propagate(s, ConstantVelocityStep{{0, 0, 0.4}, 0.01});
  EXPECT_LE(
      (s.world_from_body.translation() - Eigen::Vector3d(1.25 * std::sin(2.0), 1.25 * (1 - std::cos(2.0)), 0)).norm(),
      1e-4);
}

TEST(Propagation, NoiseMatchesItsIntegrals) {
  // White acceleration: σ² t³/3 of the position, σ² t²/2 between, σ² t of the velocity, whatever the steps.
  NavigationState s;
  ErrorCovariance p = ErrorCovariance::Zero();
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero(), up = Eigen::Vector3d::UnitZ();
  const InertialStep still{zero, zero, up, up, 0.05};
  for (int i = 0; i < 40; ++i) {
    propagate_covariance(p, transition(s, still, noise_of(0, 0.3, 0, 0), 1));
    s = propagate(s, still, 1);
  }
  EXPECT_NEAR(p(error_at::kPosition, error_at::kPosition), 0.09 * 8 / 3, 1e-9);
  EXPECT_NEAR(p(error_at::kPosition, error_at::kVelocity), 0.09 * 2, 1e-9);
  EXPECT_NEAR(p(error_at::kVelocity, error_at::kVelocity), 0.09 * 2, 1e-9);
}

TEST(Propagation, PropagatesTheCovarianceAsTheFullMatrix) {
  Random random(5);
  const NavigationState s = random_navigation_state(random);
  const Transition t = transition(s, random_step(random), noise_of(0.1, 0.2, 0.3, 0.4), 3.71);
  ErrorCovariance root;
  for (Eigen::Index i = 0; i < root.size(); ++i) root.data()[i] = random.normal();
  ErrorCovariance p = root * root.transpose();
  ErrorCovariance f = ErrorCovariance::Identity(), q = ErrorCovariance::Zero();
  f.topRows<error_at::kMoving>() = whole(t);
  q.topLeftCorner<error_at::kMoving, error_at::kMoving>() = t.noise;
  const ErrorCovariance expected = f * p * f.transpose() + q;
  propagate_covariance(p, t);
  EXPECT_LE((p - expected).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LE((p - p.transpose()).norm(), 1e-12);
}

}  // namespace
}  // namespace spartan::internal
