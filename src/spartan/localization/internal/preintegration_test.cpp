#include "spartan/localization/internal/preintegration.h"

#include <gtest/gtest.h>

#include "spartan/localization/internal/drive_test.h"
#include "spartan/testing/numeric_jacobian.h"

namespace spartan::internal {
namespace {

const Eigen::Vector3d kZero = Eigen::Vector3d::Zero();

std::vector<InertialStep> random_steps(std::uint64_t seed, int count) {
  Random random(seed);
  std::vector<InertialStep> steps;
  Eigen::Vector3d gyro = normal3(random, 0.5), accel = normal3(random, 3);
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d next_gyro = gyro + normal3(random, 0.05), next_accel = accel + normal3(random, 0.3);
    steps.push_back({gyro, next_gyro, accel, next_accel, 0.01});
    gyro = next_gyro;
    accel = next_accel;
  }
  return steps;
}

Preintegration integrated(const std::vector<InertialStep>& steps, const Eigen::Vector3d& gyro_bias,
                          const Eigen::Vector3d& accel_bias, const InertialNoise& noise = {}) {
  Preintegration p;
  p.gyro_bias_rad_s = gyro_bias;
  p.accel_bias_m_s2 = accel_bias;
  for (const InertialStep& s : steps) p.add(s, noise);
  return p;
}

TEST(Preintegration, EqualsThePropagationOfTheFilter) {
  Random random(21);
  NavigationState s = random_navigation_state(random);
  s.gravity_scale = 1;
  const NavigationState start = s;
  const auto steps = random_steps(22, 60);
  constexpr double kGravity = 3.71;
  for (const InertialStep& step : steps) s = propagate(s, step, kGravity);
  const Preintegration p = integrated(steps, start.gyro_bias_rad_s, start.accel_bias_m_s2);
  const double t = p.seconds;
  const Eigen::Matrix3d r = start.world_from_body.rotation_matrix();
  const Eigen::Vector3d g = kGravity * true_up(start.gravity_tilt_rad), v = r * start.velocity_m_s;
  EXPECT_NEAR(t, 0.6, 1e-12);
  EXPECT_LE((r * p.rotation - s.world_from_body.rotation_matrix()).norm(), 1e-9);
  EXPECT_LE((v - t * g + r * p.velocity - s.world_from_body.rotation() * s.velocity_m_s).norm(), 1e-9);
  EXPECT_LE(
      (start.world_from_body.translation() + t * v - 0.5 * t * t * g + r * p.position - s.world_from_body.translation())
          .norm(),
      1e-9);
}

TEST(Preintegration, DerivativesByTheBiasesMatchFiniteDifferences) {
  const auto steps = random_steps(23, 40);
  const Eigen::Vector3d gyro(0.02, -0.05, 0.03), accel(0.1, 0.2, -0.1);
  const Preintegration p = integrated(steps, gyro, accel);
  using Vector9d = Eigen::Matrix<double, 9, 1>;
  const auto numeric = testing::numeric_jacobian<9, 6>(
      [&](const Vector6d& biases) {
        const Preintegration q = integrated(steps, biases.head<3>(), biases.tail<3>());
        Vector9d v;
        v << log_so3(Eigen::Quaterniond(p.rotation.transpose() * q.rotation)), q.velocity, q.position;
        return v;
      },
      (Vector6d() << gyro, accel).finished());
  Eigen::Matrix<double, 9, 6> ours = Eigen::Matrix<double, 9, 6>::Zero();
  ours.block<3, 3>(0, 0) = p.rotation_by_gyro;
  ours.block<3, 3>(3, 0) = p.velocity_by_gyro;
  ours.block<3, 3>(3, 3) = p.velocity_by_accel;
  ours.block<3, 3>(6, 0) = p.position_by_gyro;
  ours.block<3, 3>(6, 3) = p.position_by_accel;
  EXPECT_LE((ours - numeric).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Preintegration, DerivativeByTheTimeOfTheReadingsMatchesFiniteDifferences) {
  const auto steps = random_steps(26, 40);
  const Preintegration p = integrated(steps, {0.02, -0.05, 0.03}, {0.1, 0.2, -0.1});
  const auto numeric = testing::numeric_jacobian<9, 1>(
      [&](const Eigen::Matrix<double, 1, 1>& later) {
        std::vector<InertialStep> shifted = steps;
        for (InertialStep& s : shifted) {
          const Eigen::Vector3d gyro = later[0] / s.seconds * (s.gyro_to - s.gyro_from),
                                accel = later[0] / s.seconds * (s.accel_to - s.accel_from);
          s.gyro_from += gyro, s.gyro_to += gyro, s.accel_from += accel, s.accel_to += accel;
        }
        const Preintegration q = integrated(shifted, p.gyro_bias_rad_s, p.accel_bias_m_s2);
        Eigen::Matrix<double, 9, 1> v;
        v << log_so3(Eigen::Quaterniond(p.rotation.transpose() * q.rotation)), q.velocity, q.position;
        return v;
      },
      Eigen::Matrix<double, 1, 1>::Zero());
  EXPECT_LE((p.by_time - numeric).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_GT(p.by_time.norm(), 0.1);
}

// Oracle: the scatter of noisy integrations.
TEST(Preintegration, CovarianceIsThatOfNoisyReadings) {
  const auto steps = random_steps(24, 30);
  InertialNoise noise;
  noise.gyro = {0.002, 0.004, 0.003};
  noise.accel = {0.05, 0.02, 0.03};
  const Preintegration exact = integrated(steps, kZero, kZero, noise);
  Random random(25);
  Eigen::Matrix<double, 9, 9> scatter = Eigen::Matrix<double, 9, 9>::Zero();
  constexpr int kTrials = 4000;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<InertialStep> noisy = steps;
    for (InertialStep& s : noisy) {
      const double root = std::sqrt(s.seconds);
      const Eigen::Vector3d rate = noise.gyro.cwiseProduct(normal3(random, 1)) / root,
                            force = noise.accel.cwiseProduct(normal3(random, 1)) / root;
      s.gyro_from += rate, s.gyro_to += rate, s.accel_from += force, s.accel_to += force;
    }
    const Preintegration p = integrated(noisy, kZero, kZero);
    Eigen::Matrix<double, 9, 1> error;
    error << log_so3(Eigen::Quaterniond(exact.rotation.transpose() * p.rotation)), p.velocity - exact.velocity,
        p.position - exact.position;
    scatter += error * error.transpose() / kTrials;
  }
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(scatter(i, i) / exact.covariance(i, i), 1, 0.12) << i;
  const auto correlation = [](const Eigen::Matrix<double, 9, 9>& c, int i, int j) {
    return c(i, j) / std::sqrt(c(i, i) * c(j, j));
  };
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(correlation(scatter, 3 + i, 6 + i), correlation(exact.covariance, 3 + i, 6 + i), 0.05);
}

}  // namespace
}  // namespace spartan::internal
