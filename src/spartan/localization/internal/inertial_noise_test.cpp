#include "spartan/localization/internal/inertial_noise.h"

#include <gtest/gtest.h>

#include "spartan/localization/internal/drive_test.h"

namespace spartan::internal {
namespace {

InertialNoiseEstimate estimate_of(double gyro_sigma, double accel_sigma) {
  Random random(31);
  InertialNoiseEstimate estimate;
  ImuSample before;
  for (int i = 0; i < 400; ++i) {
    const double t = 0.005 * i;
    // A slow, strong motion in addition, which is no noise.
    const Eigen::Vector3d rate(std::sin(2 * t), 0, 0), force(0, 5 * std::cos(3 * t), 9.81);
    const ImuSample sample{test_stamp(t), rate + normal3(random, gyro_sigma), force + normal3(random, accel_sigma)};
    if (i > 0) estimate.add(before, sample);
    before = sample;
  }
  return estimate;
}

TEST(InertialNoise, IsTheSpecifiedOneOfAQuietImu) {
  const InertialNoise noise = inertial_noise({}, estimate_of(1e-4, 1e-3));
  EXPECT_NEAR(noise.gyro.y(), InertialOptions().gyro_noise_rad_s_sqrt_hz, 1e-9);
  EXPECT_NEAR(noise.accel.x(), InertialOptions().accel_noise_m_s2_sqrt_hz, 1e-9);
}

TEST(InertialNoise, IsTheMeasuredOneOfAVibratingVehicle) {
  const InertialNoise noise = inertial_noise({}, estimate_of(0.05, 1.5));
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(noise.gyro[axis] / (0.05 * std::sqrt(0.005)), 1, 0.25);
    EXPECT_NEAR(noise.accel[axis] / (1.5 * std::sqrt(0.005)), 1, 0.25);
  }
}

TEST(InertialNoise, NeedsSomeReadings) {
  InertialNoiseEstimate estimate;
  estimate.add({test_stamp(0), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()},
               {test_stamp(0.01), {1, 1, 1}, {10, 10, 10}});
  EXPECT_NEAR(inertial_noise({}, estimate).gyro.x(), InertialOptions().gyro_noise_rad_s_sqrt_hz, 1e-12);
}

}  // namespace
}  // namespace spartan::internal
