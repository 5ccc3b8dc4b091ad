// IMU and wheels away from the body's origin, and an IMU with another clock.
#include <gtest/gtest.h>

#include "spartan/localization/internal/drive_test.h"

namespace spartan {
namespace {

using namespace internal;

const Eigen::Vector3d kArm(0.3, -0.2, 0.25);

/// A rover that drives and rocks fast enough for its lever arms to matter.
TestDrive fast_drive() {
  TestDrive drive;
  drive.speed_m_s = 0.6;
  drive.swing_m = 0.8;
  drive.relief_m = 0.12;
  drive.roll_rad = 0.2;
  return drive;
}

/// Ideal readings of an IMU at kArm.
std::vector<Measurement> imu_at_arm(const TestDrive& drive, double seconds) {
  std::vector<Measurement> samples;
  constexpr double h = 1e-3;
  const auto position = [&](double t) { return drive.at(t) * kArm; };
  for (int i = 0; i <= static_cast<int>(seconds * 100); ++i) {
    const double t = 0.01 * i;
    ImuSample s = drive.imu(t);
    const Eigen::Vector3d acceleration = (position(t + h) - 2 * position(t) + position(t - h)) / (h * h);
    s.accel_m_s2 = drive.at(t).rotation().conjugate() * (acceleration + Eigen::Vector3d(0, 0, drive.gravity_m_s2));
    samples.emplace_back(s);
  }
  return samples;
}

std::vector<Measurement> motions_of(const TestDrive& drive, double seconds) {
  std::vector<Measurement> motions;
  for (double t = 2.5; t + 0.5 <= seconds + 1e-9; t += 0.5)
    motions.emplace_back(drive.motion(t, t + 0.5, test_motion_covariance()));
  return motions;
}

double position_error(const LocalizationEstimate& e, const TestDrive& drive) {
  const double t = seconds_between(test_stamp(0), e.stamp);
  return ((drive.at(2.5).inverse() * drive.at(t)).translation() - e.world_from_body.pose.translation()).norm();
}

// Vision is lost for the last 2 s, so that the IMU alone says where the rover is.
std::vector<Measurement> without_end(std::vector<Measurement> motions, double from_s) {
  for (Measurement& m : motions) {
    auto& motion = std::get<RelativeMotion>(m);
    motion.measured = motion.to <= test_stamp(from_s);
  }
  return motions;
}

TEST(LocalizerSensorMounts, AnImuAwayFromTheBodyIsPropagatedWhereItIs) {
  const TestDrive drive = fast_drive();
  const auto all = in_order(imu_at_arm(drive, 22.5), without_end(motions_of(drive, 22.5), 20.5));
  LocalizationOptions options = test_options();
  options.imu.position_m = kArm;
  const LocalizationEstimate right = driven(options, all).estimate();
  EXPECT_EQ(right.health_of(LocalizationSensor::imu).state, SensorState::ok);
  EXPECT_LT(position_error(right, drive), 0.01);
  const double t = seconds_between(test_stamp(0), right.stamp);
  EXPECT_LT((right.velocity_m_s - drive.at(2.5).rotation().conjugate() * drive.velocity(t)).norm(), 0.01);
  EXPECT_GT(position_error(driven(test_options(), all).estimate(), drive), 0.05) << "without the lever arm";
}

TEST(LocalizerSensorMounts, WheelsAwayFromTheBodyDoNotSlipInATurn) {
  // On the spot, half a metre behind the body's origin.
  TestDrive drive;
  drive.speed_m_s = 0;
  std::vector<Measurement> all;
  const Eigen::Vector3d centre(-0.5, 0, 0);
  const auto body = [&](double t) {
    const double turned = 0.2 * std::max(0.0, t - 2.5);
    return Pose::from_translation(centre) * Pose::from_rotation(exp_so3({0, 0, turned})) *
           Pose::from_translation(-centre);
  };
  LocalizationOptions options = test_options();
  options.wheels.turning_centre_m = centre;
  for (int i = 0; i <= 450; ++i) {
    const double t = 0.05 * i, turned = 0.2 * std::max(0.0, t - 2.5), side = 0.5 * options.wheels.track_m * turned;
    all.emplace_back(WheelSample{test_stamp(t), -side, side});
  }
  for (double t = 2.5; t < 22; t += 1.5) {
    RelativeMotion m = drive.motion(t, t + 1.5, test_motion_covariance());
    m.previous_from_current = body(t).inverse() * body(t + 1.5);
    all.emplace_back(m);
  }
  std::stable_sort(all.begin(), all.end(), comes_before);
  const SensorHealth right = driven(options, all).estimate().health_of(LocalizationSensor::wheels);
  EXPECT_EQ(right.state, SensorState::ok) << right.reason;
  EXPECT_EQ(right.rejected, 0);
  EXPECT_EQ(driven(test_options(), all).estimate().health_of(LocalizationSensor::wheels).state, SensorState::excluded)
      << "with the centre at the body's origin";
}

TEST(LocalizerSensorMounts, AnImuOfAnotherClock) {
  const TestDrive drive = fast_drive();
  std::vector<Measurement> late = imu_at_arm(drive, 22.5);
  for (Measurement& m : late) std::get<ImuSample>(m).stamp.ns += 30'000'000;
  const auto all = in_order(late, without_end(motions_of(drive, 22.5), 20.5));
  LocalizationOptions options = test_options();
  options.imu.position_m = kArm;
  options.imu.time_offset_s = 0.03;
  const LocalizationEstimate right = driven(options, all).estimate();
  EXPECT_EQ(right.health_of(LocalizationSensor::imu).state, SensorState::ok);
  EXPECT_EQ(right.health_of(LocalizationSensor::imu).rejected, 0);
  EXPECT_LT(position_error(right, drive), 0.01);
  options.imu.time_offset_s = 0;
  const LocalizationEstimate found = driven(options, all).estimate();
  EXPECT_NEAR(found.imu_time_offset_s, 0.03, 0.002);
  EXPECT_NEAR(found.imu_time_offset_s, 0.03, 3 * found.imu_time_offset_sigma_s);
  EXPECT_LT(position_error(found, drive), 0.01);
  options.imu.time_offset_sigma_s = 0;
  EXPECT_GT(position_error(driven(options, all).estimate(), drive), 0.03) << "without the offset";
}

}  // namespace
}  // namespace spartan
