// An IMU whose biases change at once.
#include <gtest/gtest.h>

#include "spartan/localization/internal/drive_test.h"

namespace spartan {
namespace {

using namespace internal;

constexpr double kStep_s = 30.1, kEnd_s = 62.5;

/// A drive with frames every `period_s`, IMU and wheels; from kStep_s on the readings of the IMU are off.
LocalizationEstimate driven_with_step(double period_s, const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel) {
  const TestDrive drive;
  std::vector<Measurement> motions;
  for (double t = 2.5; t + period_s <= kEnd_s + 1e-9; t += period_s)
    motions.emplace_back(drive.motion(t, t + period_s, test_motion_covariance()));
  auto all = in_order(test_samples(drive, kEnd_s, {.compass = false, .inclinometer = false}, 71), motions);
  for (Measurement& m : all) {
    auto* imu = std::get_if<ImuSample>(&m);
    if (imu == nullptr || imu->stamp < test_stamp(kStep_s)) continue;
    imu->gyro_rad_s += gyro;
    imu->accel_m_s2 += accel;
  }
  LocalizationOptions options = test_options();
  options.imu.gyro_bias_sigma_rad_s = 1e-4;  // as specified: the step is far outside of it
  options.imu.accel_bias_sigma_m_s2 = 0.01;
  return driven(options, all).estimate();
}

double position_error(const LocalizationEstimate& e) {
  const TestDrive drive;
  const Pose first = drive.at(2.5),
             start = first_pose(first.rotation().conjugate() * Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX(), 0);
  return ((first.inverse() * drive.at(kEnd_s)).translation() - (start.inverse() * e.world_from_body.pose).translation())
      .norm();
}

TEST(LocalizerBiasStep, AnImuWithNewBiasesIsAlignedAgain) {
  const Eigen::Vector3d gyro(0.02, -0.02, 0.02), accel(0.3, 0.3, -0.3);
  for (const bool of_gyro : {true, false}) {
    const LocalizationEstimate e = driven_with_step(1.5, of_gyro ? gyro : Eigen::Vector3d::Zero().eval(),
                                                    of_gyro ? Eigen::Vector3d::Zero().eval() : accel);
    EXPECT_EQ(e.health_of(LocalizationSensor::imu).state, SensorState::ok)
        << e.health_of(LocalizationSensor::imu).reason;
    EXPECT_GE(e.health_of(LocalizationSensor::imu).rejected, 2);
    EXPECT_EQ(e.health_of(LocalizationSensor::vision).rejected, 0);
    EXPECT_LT(position_error(e), 1e-3);
    if (of_gyro) {
      EXPECT_LT((e.biases.gyro_rad_s - gyro).norm(), 2e-3);
    } else {
      EXPECT_LT((e.biases.accel_m_s2 - accel).norm(), 0.05);
    }
  }
}

// The wheels have corrected the prediction of the IMU before the frame, or were rejected against it.
TEST(LocalizerBiasStep, WheelsConfirmVisionBetweenRareFrames) {
  const LocalizationEstimate e = driven_with_step(3, Eigen::Vector3d::Zero(), {1, 1, -1});
  EXPECT_EQ(e.health_of(LocalizationSensor::vision).rejected, 0) << e.health_of(LocalizationSensor::vision).reason;
  EXPECT_LT(position_error(e), 1e-3);
}

}  // namespace
}  // namespace spartan
