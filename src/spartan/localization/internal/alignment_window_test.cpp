#include "spartan/localization/internal/alignment_window.h"

#include <gtest/gtest.h>

#include "spartan/localization/internal/drive_test.h"

namespace spartan::internal {
namespace {

/// A vehicle in motion from the first moment on, tilted as it likes.
struct Flight {
  double gravity_m_s2 = 9.81;
  Eigen::Vector3d gyro_bias{-0.02, 0.03, 0.08}, accel_bias{0.15, -0.1, 0.2};
  double imu_late_s = 0;  ///< stamps of the IMU

  Pose at(double t) const {
    const Eigen::Vector3d turn(0.9 + 0.3 * std::sin(1.3 * t), 0.25 * std::sin(1.9 * t + 1), 0.5 * t);
    return {exp_so3(turn), {std::sin(1.1 * t), std::cos(0.9 * t), 0.3 * std::sin(1.7 * t)}};
  }
  ImuSample imu(double stamp) const {
    const double t = stamp - imu_late_s;
    constexpr double h = 1e-3;
    const Pose now = at(t), before = at(t - h), after = at(t + h);
    const Eigen::Vector3d acceleration = (after.translation() - 2 * now.translation() + before.translation()) / (h * h);
    return {test_stamp(stamp), log_so3(before.rotation().conjugate() * after.rotation()) / (2 * h) + gyro_bias,
            now.rotation().conjugate() * (acceleration + Eigen::Vector3d(0, 0, gravity_m_s2)) + accel_bias};
  }
  Eigen::Vector3d velocity(double t) const {
    constexpr double h = 1e-4;
    return at(t).rotation().conjugate() * (at(t + h).translation() - at(t - h).translation()) / (2 * h);
  }
};

constexpr double kFrame_s = 0.07;  // frames lie between the samples of the IMU

RelativeMotion motion_of(const Flight& flight, int frame, Random& random, double sigma) {
  RelativeMotion m;
  m.from = test_stamp(kFrame_s * frame);
  m.to = test_stamp(kFrame_s * (frame + 1));
  m.previous_from_current = flight.at(kFrame_s * frame).inverse() * flight.at(kFrame_s * (frame + 1));
  m.covariance = sigma * sigma * Matrix6d::Identity();
  Vector6d error;
  for (int i = 0; i < 6; ++i) error[i] = random.normal(0, sigma);
  m.previous_from_current = m.previous_from_current * exp_se3(error);
  return m;
}

InertialNoise small_noise() {
  InertialNoise noise;
  noise.gyro.setConstant(1.7e-4);
  noise.accel.setConstant(2e-3);
  return noise;
}

AlignmentWindow filled(const Flight& flight, int frames, double sigma, std::uint64_t seed) {
  AlignmentWindow window;
  Random random(seed);
  window.begin(test_stamp(0));
  int frame = 0;
  ImuSample before = flight.imu(-0.01);
  for (int i = 0; 0.01 * i <= kFrame_s * frames + 0.015; ++i) {
    const double t = 0.01 * i;
    while (frame < frames && kFrame_s * (frame + 1) < t) window.add(motion_of(flight, frame++, random, sigma));
    const ImuSample sample = flight.imu(t);
    window.add(before, sample, small_noise(), 0.25);
    before = sample;
  }
  return window;
}

const AlignmentPrior kPrior{0.05, 0.3, 9.81, 0, std::nullopt, 0};

TEST(AlignmentWindow, FindsBiasesVelocityAndGravityInMotion) {
  const Flight flight;
  const AlignmentWindow window = filled(flight, 30, 5e-5, 3);
  EXPECT_NEAR(window.seconds(), 30 * kFrame_s, 1e-9);
  const auto a = window.align(kPrior);
  ASSERT_TRUE(a);
  const double t = 30 * kFrame_s;
  EXPECT_LE((a->gyro_bias_rad_s - flight.gyro_bias).norm(), 1e-3);
  EXPECT_LE((a->velocity_m_s - flight.velocity(t)).norm(), 0.02);
  const Eigen::Vector3d up = flight.at(t).rotation().conjugate() * Eigen::Vector3d::UnitZ();
  EXPECT_LE((a->up - up).norm(), 0.01);
  EXPECT_LE((a->accel_bias_m_s2 - flight.accel_bias).norm(), 0.1);
}

TEST(AlignmentWindow, FindsTheOffsetOfTheClock) {
  Flight flight;
  flight.imu_late_s = 0.02;
  const AlignmentWindow window = filled(flight, 30, 5e-5, 3);
  EXPECT_FALSE(window.align(kPrior)) << "the clocks are said to agree";
  AlignmentPrior prior = kPrior;
  prior.time_s = 0.01;
  const auto a = window.align(prior);
  ASSERT_TRUE(a);
  EXPECT_NEAR(a->time_offset_s, 0.02, 1e-3);
  EXPECT_LE((a->gyro_bias_rad_s - flight.gyro_bias).norm(), 2e-3);
  EXPECT_GT(std::sqrt(a->covariance(12, 12)), 1e-5);
  EXPECT_LT(std::sqrt(a->covariance(12, 12)), 1e-3);
}

TEST(AlignmentWindow, TheFirstMotionGivesTheNominalBiasOfTheGyro) {
  Flight flight;
  flight.gyro_bias = {-0.5, 0.4, 0.8};
  const AlignmentWindow window = filled(flight, 30, 5e-5, 3);
  EXPECT_NEAR(window.seconds(), 29 * kFrame_s, 1e-9);
  AlignmentPrior prior = kPrior;
  prior.gyro_bias_rad_s = 1;
  const auto a = window.align(prior);
  ASSERT_TRUE(a);
  EXPECT_LE((a->gyro_bias_rad_s - flight.gyro_bias).norm(), 2e-3);
}

TEST(AlignmentWindow, CovarianceFitsTheErrors) {
  double sum = 0;
  constexpr int kTrials = 40;
  Random random(9);
  for (int trial = 0; trial < kTrials; ++trial) {
    Flight flight;
    flight.gyro_bias = normal3(random, 0.05);
    flight.accel_bias = normal3(random, 0.3);
    const auto a = filled(flight, 20, 3e-4, 100 + static_cast<std::uint64_t>(trial)).align(kPrior);
    ASSERT_TRUE(a);
    const double t = 20 * kFrame_s;
    Eigen::Matrix<double, 9, 1> error;
    error << a->gyro_bias_rad_s - flight.gyro_bias, a->accel_bias_m_s2 - flight.accel_bias,
        a->velocity_m_s - flight.velocity(t);
    sum += error.dot(a->covariance.topLeftCorner<9, 9>().ldlt().solve(error)) / kTrials;
  }
  // Mean of 40 chi-square variables with 9 degrees of freedom: 9 ± 0.67. The noise factor is at least 1.
  EXPECT_GT(sum, 5.5);
  EXPECT_LT(sum, 11);
}

TEST(AlignmentWindow, RefusesAnImuThatDoesNotFit) {
  Flight flight;
  flight.gravity_m_s2 = 3.71;  // another planet
  EXPECT_FALSE(filled(flight, 30, 5e-5, 4).align(kPrior));
  flight = {};
  flight.gyro_bias.z() = 1;  // 20 standard deviations
  EXPECT_FALSE(filled(flight, 30, 5e-5, 4).align(kPrior));
}

TEST(AlignmentWindow, ALostMotionBeginsAnew) {
  const Flight flight;
  AlignmentWindow window = filled(flight, 10, 5e-5, 5);
  ASSERT_GT(window.seconds(), 0);
  Random random(6);
  RelativeMotion lost = motion_of(flight, 10, random, 5e-5);
  lost.measured = false;
  lost.keeps_reference = true;
  window.add(lost);
  EXPECT_GT(window.seconds(), 0) << "the next motion begins at the same frame";
  lost.keeps_reference = false;
  window.add(lost);
  EXPECT_EQ(window.seconds(), 0);
}

TEST(AlignmentWindow, AGapOfTheImuBeginsAnew) {
  const Flight flight;
  AlignmentWindow window = filled(flight, 10, 5e-5, 7);
  EXPECT_FALSE(window.add(flight.imu(0.71), flight.imu(1.1), small_noise(), 0.25));
  EXPECT_EQ(window.seconds(), 0);
}

}  // namespace
}  // namespace spartan::internal
