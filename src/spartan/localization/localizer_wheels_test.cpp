#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "spartan/localization/internal/drive_test.h"

namespace spartan::internal {
namespace {

constexpr double kTrack_m = 0.5, kWheelPeriod_s = 0.5;

double yaw_of(const Pose& pose) {
  const Eigen::Vector3d ahead = pose.rotation() * Eigen::Vector3d::UnitX();
  return std::atan2(ahead.y(), ahead.x());
}

// A winding drive in the plane, measured by both wheels and the inclinometer only.
std::vector<Measurement> turning_wheels(const TestDrive& drive, double seconds) {
  std::vector<Measurement> samples;
  double rolled = 0;
  for (int i = 0; i <= static_cast<int>(seconds / kWheelPeriod_s); ++i) {
    const double t = i * kWheelPeriod_s;
    rolled += (drive.at(t).translation() - drive.at(t - kWheelPeriod_s).translation()).norm();
    const double half = 0.5 * kTrack_m * yaw_of(drive.at(t));
    samples.emplace_back(WheelSample{test_stamp(t), rolled - half, rolled + half});
    samples.emplace_back(InclinometerSample{test_stamp(t), 0, 0, 0.0035});
  }
  return samples;
}

LocalizationOptions wheel_options() {
  LocalizationOptions options = test_options();
  options.wheels.track_m = kTrack_m;
  options.wheels.max_step_s = 2 * kWheelPeriod_s;
  options.constant_velocity.rate_offset_rad_s = 0.2;  // the wheels are the source of the rotation
  return options;
}

// Of the position; the perturbation is in the body frame.
Eigen::Matrix3d in_world(const UncertainPose& pose) {
  const Eigen::Matrix3d rotation = pose.pose.rotation_matrix();
  return rotation * pose.covariance.topLeftCorner<3, 3>() * rotation.transpose();
}

UncertainPose end_of(const TestDrive& drive, double seconds, const LocalizationOptions& options) {
  return driven(options, turning_wheels(drive, seconds)).estimate().world_from_body;
}

TestDrive flat_drive() {
  TestDrive drive;
  drive.relief_m = drive.roll_rad = 0;
  return drive;
}

// Steps of two samples end at 3.5 s, 4.5 s …
TEST(LocalizerWheels, DifferenceOfTheWheelsIsARotation) {
  const TestDrive drive = flat_drive();
  for (const double seconds : {4.5, 12.5, 44.5}) {
    LocalizationOptions options = wheel_options();
    const double truth = yaw_of(drive.at(seconds));
    ASSERT_GT(truth, 0.04);
    EXPECT_NEAR(yaw_of(end_of(drive, seconds, options).pose), truth, 0.08 * truth) << seconds;
    options.wheels.use_rotation = false;
    EXPECT_EQ(yaw_of(end_of(drive, seconds, options).pose), 0) << seconds;
  }
}

// Between frames, without an IMU, the steps of the wheels predict the pose; vision then replaces the prediction, and
// nothing of it is left.
TEST(LocalizerWheels, LeavesNothingBehindWhereVisionMeasures) {
  const TestDrive drive;
  const double seconds = 60;
  std::vector<Measurement> motions;
  const auto move = [&](double from, double to) {
    motions.emplace_back(drive.motion(from, to, test_motion_covariance()));
  };
  for (double t = 2.5; t + 1.5 <= 20; t += 1.5) move(t, t + 1.5);
  move(19, 28);  // the wheels end several steps in between
  move(28, 37);
  for (double t = 37; t + 1.5 <= seconds; t += 1.5) move(t, t + 1.5);
  const auto end = [&](bool wheels) {
    const auto samples = test_samples(drive, seconds, {false, wheels, false, false}, 4);
    return driven(test_options(), in_order(samples, motions)).estimate_at(test_stamp(58))->world_from_body;
  };
  const UncertainPose with = end(true), without = end(false);
  EXPECT_LT(log_se3(with.pose.inverse() * without.pose).norm(), 1e-14);
  EXPECT_LT((with.covariance - without.covariance).norm(), 1e-12 * without.covariance.norm());
}

TEST(LocalizerWheels, RotationIsAsUncertainAsTheWheels) {
  TestDrive straight = flat_drive();
  straight.swing_m = 0;
  const LocalizationOptions options = wheel_options();
  const double length = straight.travelled(3.5);  // of the first step
  const double forward = std::hypot(options.wheels.min_sigma_m, options.wheels.forward_sigma_ratio * length);
  const double yaw = std::sqrt(2.0) * forward / kTrack_m;  // of two wheels with that error each
  EXPECT_NEAR(std::sqrt(end_of(straight, 3.5, options).covariance(5, 5)), yaw, 0.02 * yaw);
}

// Vision is lost from 30 s on, and frames still come. Steps that ended with each frame were too short to be measured.
TEST(LocalizerWheels, MeasureAtEveryRateOfFrames) {
  const TestDrive drive;
  constexpr double kEnd_s = 60;
  for (const double period : {1.5, 0.5, 0.1, 0.05}) {
    std::vector<Measurement> motions;
    for (double t = 2.5; t + period < kEnd_s; t += period) {
      RelativeMotion m = drive.motion(t, t + period, test_motion_covariance());
      m.measured = m.to < test_stamp(30);
      motions.emplace_back(m);
    }
    const auto samples = test_samples(drive, kEnd_s, {}, 4);
    const auto at_58 = driven(test_options(), in_order(samples, motions)).estimate_at(test_stamp(58));
    ASSERT_TRUE(at_58) << period;
    const Eigen::Vector3d error = at_58->world_from_body.pose.translation() - drive.at(58).translation();
    EXPECT_LT(error.norm(), 0.015 * (drive.travelled(58) - drive.travelled(30))) << period;
    const Eigen::Matrix3d covariance = in_world(at_58->world_from_body);
    EXPECT_LT(error.dot(covariance.ldlt().solve(error)), 14.2) << period;  // chi-square of 3, 99.7 %
    ASSERT_TRUE(at_58->slip) << period;
    EXPECT_NEAR(at_58->slip->slip, 0.02, 3 * at_58->slip->sigma) << period;
    EXPECT_LT(at_58->slip->sigma, 0.11) << period;
  }
}

}  // namespace
}  // namespace spartan::internal
