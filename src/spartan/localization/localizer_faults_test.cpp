// Sensors that are late, missing, frozen or wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "spartan/localization/internal/chi_square.h"
#include "spartan/localization/internal/drive_test.h"
#include "spartan/localization/localizer.h"
#include "spartan/numerics/random.h"

namespace spartan {

using namespace internal;

namespace {

using Samples = std::vector<Measurement>;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Samples whole_drive(double seconds, const TestSensors& with, std::uint64_t seed) {
  const TestDrive drive;
  return in_order(test_samples(drive, seconds, with, seed), test_motions(drive, seconds, 1, seed + 1));
}

bool within(const Measurement& m, double from, double to) {
  return stamp_of_measurement(m) >= test_stamp(from) && stamp_of_measurement(m) < test_stamp(to);
}

// The attitude of the world follows from the readings at the start.
Pose first_pose_of(const Samples& all) {
  Samples before;
  std::copy_if(all.begin(), all.end(), std::back_inserter(before),
               [](const Measurement& m) { return stamp_of_measurement(m) <= test_stamp(2.5); });
  Localizer localizer = Localizer::create(test_options()).value();
  for (const Measurement& m : before) localizer.add(m);
  localizer.start(test_stamp(2.5), Eigen::Vector3d::UnitX());
  return localizer.estimate().world_from_body.pose;
}

void expect_consistent(const LocalizationEstimate& e, const Samples& all) {
  const TestDrive drive;
  const double t = seconds_between(test_stamp(0), e.stamp);
  const Pose truth = first_pose_of(all) * drive.at(2.5).inverse() * drive.at(t);
  const Vector6d error = log_se3(e.world_from_body.pose.inverse() * truth);
  EXPECT_LE(error.dot(e.world_from_body.covariance.inverse() * error), chi_square_quantile(0.9999, 6))
      << error.transpose();
}

SensorHealth health_at(const Samples& all, double t, LocalizationSensor sensor) {
  Samples until;
  std::copy_if(all.begin(), all.end(), std::back_inserter(until),
               [&](const Measurement& m) { return stamp_of_measurement(m) <= test_stamp(t); });
  return driven(test_options(), until).estimate().health_of(sensor);
}

TEST(LocalizerFaults, WrongCompassIsExcludedAndReadmitted) {
  Samples all = whole_drive(82.5, {}, 41);
  for (Measurement& m : all) {
    if (auto* compass = std::get_if<CompassSample>(&m); compass && within(m, 20, 35)) compass->heading_rad += 1.0;
  }
  const SensorHealth lying = health_at(all, 34.5, LocalizationSensor::compass);
  EXPECT_EQ(lying.state, SensorState::excluded);
  EXPECT_THAT(lying.reason, ::testing::HasSubstr("disagrees"));
  const LocalizationEstimate end = driven(test_options(), all).estimate();
  EXPECT_EQ(end.health_of(LocalizationSensor::compass).state, SensorState::ok);
  EXPECT_GE(end.health_of(LocalizationSensor::compass).rejected, 15);
  expect_consistent(end, all);
}

TEST(LocalizerFaults, CompassWithAPermanentChangeIsReadmittedWithANewOffset) {
  Samples all = whole_drive(82.5, {}, 53);
  for (Measurement& m : all) {
    if (auto* compass = std::get_if<CompassSample>(&m); compass && within(m, 20, 1e3)) compass->heading_rad -= 0.5;
  }
  const LocalizationEstimate end = driven(test_options(), all).estimate();
  EXPECT_EQ(end.health_of(LocalizationSensor::compass).state, SensorState::ok);
  EXPECT_NEAR(*end.heading.compass_offset_rad, -0.5, 0.05);
  expect_consistent(end, all);
}

TEST(LocalizerFaults, CompassThatStartsLateInitializesItsOffset) {
  Samples all = whole_drive(62.5, {}, 42);
  std::erase_if(all, [](const Measurement& m) { return m.index() == 3 && within(m, 0, 20); });
  for (Measurement& m : all) {
    if (auto* compass = std::get_if<CompassSample>(&m)) compass->heading_rad += 2.0;
  }
  std::get<CompassSample>(*std::find_if(all.begin(), all.end(), [](const Measurement& m) {
    return m.index() == 3;
  })).heading_rad = -1;  // the very first one is an outlier
  const LocalizationEstimate e = driven(test_options(), all).estimate();
  EXPECT_FALSE(e.heading.east);
  ASSERT_TRUE(e.heading.compass_offset_rad.has_value());
  EXPECT_NEAR(*e.heading.compass_offset_rad, 2.0, 4 * e.heading.compass_offset_sigma_rad);
  EXPECT_LT(e.heading.compass_offset_sigma_rad, 0.01);
  EXPECT_LE(e.health_of(LocalizationSensor::compass).rejected, 2) << "the outlier did not become the offset";
  expect_consistent(e, all);
}

TEST(LocalizerFaults, SlippingWheelsAreExcludedAndSlipIsEstimated) {
  Samples all = whole_drive(82.5, {}, 43);
  double slipped = 0;
  WheelSample last{};
  for (Measurement& m : all) {
    auto* wheels = std::get_if<WheelSample>(&m);
    if (wheels == nullptr) continue;
    const WheelSample now = *wheels;
    if (within(m, 20, 40)) slipped += 4 * (now.left_m - last.left_m);
    last = now;
    wheels->left_m += slipped;
    wheels->right_m += slipped;
  }
  Samples until;
  std::copy_if(all.begin(), all.end(), std::back_inserter(until),
               [](const Measurement& m) { return stamp_of_measurement(m) <= test_stamp(38); });
  const LocalizationEstimate slipping = driven(test_options(), until).estimate();
  EXPECT_EQ(slipping.health_of(LocalizationSensor::wheels).state, SensorState::excluded);
  EXPECT_THAT(slipping.health_of(LocalizationSensor::wheels).reason, ::testing::HasSubstr("slip"));
  ASSERT_TRUE(slipping.slip.has_value());
  EXPECT_NEAR(slipping.slip->slip, 1 - 0.98 / 5, 4 * slipping.slip->sigma);
  EXPECT_LT(slipping.slip->sigma, 0.05);
  const LocalizationEstimate end = driven(test_options(), all).estimate();
  EXPECT_EQ(end.health_of(LocalizationSensor::wheels).state, SensorState::ok);
  EXPECT_NEAR(end.slip->slip, 0.02, 4 * end.slip->sigma);
  expect_consistent(end, all);
}

TEST(LocalizerFaults, FrozenImuIsExcludedAndReadmitted) {
  Samples all = whole_drive(62.5, {}, 44);
  ImuSample held;
  for (Measurement& m : all) {
    auto* imu = std::get_if<ImuSample>(&m);
    if (imu == nullptr) continue;
    if (!within(m, 20, 30)) {
      held = *imu;
    } else {
      imu->gyro_rad_s = held.gyro_rad_s;
      imu->accel_m_s2 = held.accel_m_s2;
    }
  }
  const SensorHealth frozen = health_at(all, 25, LocalizationSensor::imu);
  EXPECT_EQ(frozen.state, SensorState::excluded);
  EXPECT_THAT(frozen.reason, ::testing::HasSubstr("frozen"));
  const LocalizationEstimate end = driven(test_options(), all).estimate();
  EXPECT_EQ(end.health_of(LocalizationSensor::imu).state, SensorState::ok);
  expect_consistent(end, all);
}

TEST(LocalizerFaults, VisionResetsThePredictionOfAWrongImu) {
  Samples all = whole_drive(92.5, {}, 45);
  for (Measurement& m : all) {
    auto* imu = std::get_if<ImuSample>(&m);
    if (imu != nullptr && within(m, 20, 40)) imu->gyro_rad_s.z() += 0.3, imu->accel_m_s2.x() += 2;
  }
  const SensorHealth lying = health_at(all, 35, LocalizationSensor::imu);
  EXPECT_EQ(lying.state, SensorState::excluded);
  EXPECT_THAT(lying.reason, ::testing::HasSubstr("contradicts visual odometry"));
  const LocalizationEstimate end = driven(test_options(), all).estimate();
  EXPECT_EQ(end.health_of(LocalizationSensor::imu).state, SensorState::ok);
  EXPECT_EQ(end.health_of(LocalizationSensor::vision).state, SensorState::ok);
  expect_consistent(end, all);
}

TEST(LocalizerFaults, VisionIsRejectedIfImuAndWheelsContradictIt) {
  Samples all = whole_drive(62.5, {}, 46);
  int spoiled = 0;
  for (Measurement& m : all) {
    auto* motion = std::get_if<RelativeMotion>(&m);
    if (motion == nullptr || !within(m, 30, 33)) continue;
    motion->previous_from_current = Pose::from_translation({0.5, 0, 0}) * motion->previous_from_current;
    ++spoiled;
  }
  ASSERT_EQ(spoiled, 2);
  const LocalizationEstimate end = driven(test_options(), all).estimate();
  EXPECT_EQ(end.health_of(LocalizationSensor::vision).rejected, 2);
  EXPECT_EQ(end.health_of(LocalizationSensor::vision).state, SensorState::ok);
  expect_consistent(end, all);
}

// Repeating texture: for 13 frames vision reports a few millimetres where the rover drives 90 mm, with its usual
// covariance.
TEST(LocalizerFaults, ImuAndWheelsThatAgreeOutvoteVision) {
  for (const double from_s : {2.4, 30.0}) {
    SCOPED_TRACE(from_s);
    Samples all = whole_drive(72.5, {}, 46);
    int spoiled = 0;
    Random random(4);
    for (Measurement& m : all) {
      auto* motion = std::get_if<RelativeMotion>(&m);
      if (motion == nullptr || !within(m, from_s + 1.6, from_s + 21)) continue;
      const Eigen::Vector3d moved(random.uniform(0, 0.008), random.normal(0, 0.001), random.normal(0, 0.001));
      motion->previous_from_current = Pose(motion->previous_from_current.rotation(), moved);
      ++spoiled;
    }
    ASSERT_GE(spoiled, 12);
    LocalizationOptions options;
    options.gravity_m_s2 = 3.71;
    const LocalizationEstimate end = driven(options, all).estimate();
    EXPECT_GE(end.health_of(LocalizationSensor::vision).rejected, spoiled - 1);
    EXPECT_EQ(end.health_of(LocalizationSensor::vision).state, SensorState::ok) << "readmitted";
    EXPECT_EQ(end.health_of(LocalizationSensor::imu).rejected, 0);
    const TestDrive drive;
    const Pose truth =
        first_pose_of(all) * drive.at(2.5).inverse() * drive.at(seconds_between(test_stamp(0), end.stamp));
    const double path_m = drive.rolled(72.5);
    EXPECT_LT((end.world_from_body.pose.translation() - truth.translation()).norm(), 0.02 * path_m);
  }
}

// The same, and the wheels fall silent while vision is excluded and still wrong.
TEST(LocalizerFaults, ExcludedVisionAloneDoesNotResetThePrediction) {
  Samples all = whole_drive(52.5, {}, 46);
  for (Measurement& m : all) {
    auto* motion = std::get_if<RelativeMotion>(&m);
    if (motion != nullptr && within(m, 31.6, 46))
      motion->previous_from_current = Pose(motion->previous_from_current.rotation(), {0.004, 0, 0});
  }
  std::erase_if(all, [](const Measurement& m) { return std::holds_alternative<WheelSample>(m) && within(m, 41, 46); });
  EXPECT_EQ(health_at(all, 40.9, LocalizationSensor::vision).state, SensorState::excluded);
  const LocalizationEstimate end = driven(test_options(), all).estimate();
  EXPECT_EQ(end.health_of(LocalizationSensor::imu).rejected, 0);
  const TestDrive drive;
  const Pose truth = first_pose_of(all) * drive.at(2.5).inverse() * drive.at(seconds_between(test_stamp(0), end.stamp));
  EXPECT_LT((end.world_from_body.pose.translation() - truth.translation()).norm(), 0.02 * drive.rolled(52.5));
}

TEST(LocalizerFaults, BridgesAnOutageOfVision) {
  for (const int mask : {0, 1, 2, 3, 15}) {
    SCOPED_TRACE(mask);
    Samples all = whole_drive(62.5, {(mask & 1) != 0, (mask & 2) != 0, (mask & 4) != 0, (mask & 8) != 0}, 47);
    for (Measurement& m : all) {
      if (auto* motion = std::get_if<RelativeMotion>(&m); motion && within(m, 30, 40)) motion->measured = false;
    }
    const SensorHealth dark = health_at(all, 38, LocalizationSensor::vision);
    EXPECT_EQ(dark.state, SensorState::suspect);
    EXPECT_THAT(dark.reason, ::testing::HasSubstr("no motion estimate"));
    const LocalizationEstimate end = driven(test_options(), all).estimate();
    EXPECT_EQ(end.health_of(LocalizationSensor::vision).state, SensorState::ok);
    expect_consistent(end, all);
    if (mask == 15) {
      EXPECT_LT(end.world_from_body.covariance.diagonal().head<3>().maxCoeff(), 0.05 * 0.05);
    }
  }
}

TEST(LocalizerFaults, ImuThatStartsLateIsAlignedToGravity) {
  // The rover starts on a slope without a measured vertical; its IMU starts after 20 s.
  Samples all = whole_drive(72.5, {true, false, false, false}, 48);
  const TestDrive drive;
  std::erase_if(all, [](const Measurement& m) { return m.index() == 0 && within(m, 0, 20); });
  const Eigen::Quaterniond slope = Eigen::Quaterniond(Eigen::AngleAxisd(0.9, Eigen::Vector3d::UnitY()));
  for (Measurement& m : all) {
    auto* imu = std::get_if<ImuSample>(&m);
    if (imu == nullptr) continue;
    const Pose pose = drive.at(seconds_between(test_stamp(0), imu->stamp));
    const Eigen::Vector3d g(0, 0, drive.gravity_m_s2);
    imu->accel_m_s2 += pose.rotation().conjugate() * (slope * g - g);
  }
  Samples until;
  std::copy_if(all.begin(), all.end(), std::back_inserter(until),
               [](const Measurement& m) { return within(m, 0, 21.2); });
  const Eigen::Vector3d soon = driven(test_options(), until).estimate().up_in_world;
  EXPECT_LE((soon - slope * Eigen::Vector3d::UnitZ()).norm(), 0.03) << "at once, whatever the slope";
  const LocalizationEstimate e = driven(test_options(), all).estimate();
  EXPECT_FALSE(e.gravity_measured);
  EXPECT_EQ(e.health_of(LocalizationSensor::imu).state, SensorState::ok);
  EXPECT_GT(e.health_of(LocalizationSensor::imu).used, 5000);
  EXPECT_LE((e.up_in_world - slope * Eigen::Vector3d::UnitZ()).norm(), 0.005);
  expect_consistent(e, all);
}

TEST(LocalizerFaults, RefusesAndCountsInvalidSamples) {
  Localizer localizer = Localizer::create(test_options()).value();
  localizer.add(ImuSample{test_stamp(0), {kNan, 0, 0}, {0, 0, 3.71}});
  localizer.start(test_stamp(1), Eigen::Vector3d::UnitX());
  EXPECT_FALSE(localizer.add(WheelSample{test_stamp(1.1), kNan, 0}));
  EXPECT_FALSE(localizer.add(CompassSample{test_stamp(1.1), 0, kNan}));
  EXPECT_FALSE(localizer.add(InclinometerSample{test_stamp(1.1), kNan, 0, 0.1}));
  RelativeMotion motion{test_stamp(1), test_stamp(2), {}, Matrix6d::Identity(), true};
  motion.covariance(1, 1) = -1;
  EXPECT_FALSE(localizer.add(motion));
  motion.covariance(1, 1) = kNan;
  EXPECT_FALSE(localizer.add(motion));
  EXPECT_FALSE(localizer.add(RelativeMotion{test_stamp(2), test_stamp(1), {}, Matrix6d::Identity(), true}));
  EXPECT_FALSE(localizer.add(PoseConstraint{test_stamp(2), {}, kNan * Matrix6d::Identity()}));
  EXPECT_FALSE(localizer.add(CompassSample{test_stamp(0.5), 0, 0.1}));
  EXPECT_TRUE(localizer.add(CompassSample{test_stamp(1.5), 0, 0.1}));
  EXPECT_FALSE(localizer.add(CompassSample{test_stamp(1.5), 0.1, 0.1}));
  const LocalizationEstimate e = localizer.estimate();
  EXPECT_EQ(e.health_of(LocalizationSensor::imu).refused.not_finite, 1);
  EXPECT_EQ(e.health_of(LocalizationSensor::vision).refused.not_finite, 2);
  EXPECT_EQ(e.health_of(LocalizationSensor::vision).refused.reversed, 1);
  EXPECT_EQ(e.health_of(LocalizationSensor::compass).refused.duplicates, 1);
  EXPECT_EQ(e.health_of(LocalizationSensor::compass).refused.too_late, 1);
  EXPECT_TRUE(e.world_from_body.pose.all_finite());
}

TEST(LocalizerFaults, AStampFarAheadIsRefusedAlone) {
  const Samples all = whole_drive(42.5, {}, 53);
  Localizer localizer = Localizer::create(test_options()).value();
  // A clock that is corrected after its first two samples, and one stamp far ahead just before the start.
  for (const double t : {0.0, 1.0}) EXPECT_TRUE(localizer.add(CompassSample{{2 * test_stamp(t).ns}, 0.3, 0.1}));
  EXPECT_FALSE(localizer.add(CompassSample{test_stamp(-0.1), 0.3, 0.1}));
  int refused = 0;
  for (const Measurement& m : all) {
    if (stamp_of_measurement(m) > test_stamp(2.5) && !localizer.started()) {
      EXPECT_FALSE(localizer.add(CompassSample{test_stamp(7200), 0.3, 0.1}));
      localizer.start(test_stamp(2.5), Eigen::Vector3d::UnitX());
    }
    EXPECT_TRUE(localizer.add(m));
    if (stamp_of_measurement(m) == test_stamp(20)) {
      EXPECT_FALSE(localizer.add(WheelSample{test_stamp(3600), 1, 1}));
      ++refused;
      EXPECT_FALSE(localizer.add(ImuSample{test_stamp(3600), Eigen::Vector3d::Zero(), Eigen::Vector3d(0, 0, 3.71)}));
    }
  }
  const LocalizationEstimate e = localizer.estimate(), expected = driven(test_options(), all).estimate();
  EXPECT_EQ(e.health_of(LocalizationSensor::wheels).refused.too_early, refused);
  EXPECT_EQ(e.health_of(LocalizationSensor::compass).refused.too_early, 1);
  EXPECT_EQ(e.health_of(LocalizationSensor::compass).refused.too_late, 1);
  EXPECT_EQ(e.world_from_body.pose.matrix(), expected.world_from_body.pose.matrix());
  // A frame may advance the time that far, if the next sample confirms it.
  EXPECT_TRUE(localizer.add(RelativeMotion{test_stamp(42.5), test_stamp(4000), {}, Matrix6d::Identity(), false}));
  EXPECT_TRUE(localizer.add(WheelSample{test_stamp(4000.1), 1, 1}));
}

TEST(LocalizerFaults, ImuOutageDuringAStopEndsZeroVelocityUpdates) {
  // The rover stays stationary for 10 s; the IMU fails, the rover drives on.
  TestDrive drive;
  Samples all = whole_drive(62.5, {}, 54);
  for (Measurement& m : all) {
    std::visit(
        [](auto& value) {
          constexpr std::int64_t kLater_ns = 10'000'000'000;
          if constexpr (requires { value.stamp; }) {
            value.stamp.ns += kLater_ns;
          } else {
            value.from.ns += kLater_ns;
            value.to.ns += kLater_ns;
          }
        },
        m);
  }
  Samples stationary = test_samples({.speed_m_s = 0}, 12.4, {}, 54);
  std::erase_if(all,
                [](const Measurement& m) { return m.index() == 0 || stamp_of_measurement(m) <= test_stamp(12.4); });
  all.insert(all.begin(), stationary.begin(), stationary.end());
  all.emplace_back(drive.motion(2.5, 2.5, test_motion_covariance()));
  std::get<RelativeMotion>(all.back()).to = test_stamp(12.5);
  std::stable_sort(all.begin(), all.end(), comes_before);
  const LocalizationEstimate e = driven(test_options(), all).estimate();
  EXPECT_EQ(e.health_of(LocalizationSensor::imu).state, SensorState::missing);
  ASSERT_TRUE(e.slip) << "wheel steps continue";
  EXPECT_GT(e.slip->stamp, test_stamp(70));
  EXPECT_GT(e.health_of(LocalizationSensor::wheels).used, 20);
}

TEST(LocalizerFaults, ImuIsReadmittedAfterASingleFailure) {
  // Spikes between frames, with good frames in between.
  Samples all = whole_drive(92.5, {}, 55);
  for (Measurement& m : all) {
    auto* imu = std::get_if<ImuSample>(&m);
    if (imu != nullptr && (within(m, 20.2, 20.7) || within(m, 40.2, 40.7) || within(m, 60.2, 60.7)))
      imu->gyro_rad_s.z() += 0.3;
  }
  EXPECT_EQ(health_at(all, 22.2, LocalizationSensor::imu).state, SensorState::suspect);
  EXPECT_EQ(health_at(all, 24, LocalizationSensor::imu).state, SensorState::ok);
  EXPECT_EQ(health_at(all, 62.2, LocalizationSensor::imu).state, SensorState::suspect) << "not three in a row";
  const LocalizationEstimate end = driven(test_options(), all).estimate();
  EXPECT_EQ(end.health_of(LocalizationSensor::imu).state, SensorState::ok);
  expect_consistent(end, all);
}

TEST(LocalizerFaults, ZeroVelocityUpdatesHoldThePose) {
  // 10 s without a frame, with a noisy IMU and stationary wheels.
  const TestDrive drive;
  Samples all = test_samples(drive, 2.5, {}, 49);
  const auto later = test_samples({.speed_m_s = 0}, 12.5, {}, 49);
  std::copy_if(later.begin(), later.end(), std::back_inserter(all),
               [](const Measurement& m) { return stamp_of_measurement(m) > test_stamp(2.5); });
  const LocalizationEstimate e = driven(test_options(), all).estimate();
  const Pose moved = first_pose_of(all).inverse() * e.world_from_body.pose;
  EXPECT_LE(moved.translation().norm(), 1.5e-3);
  EXPECT_LE(std::sqrt(e.world_from_body.covariance(0, 0)), 1e-3);
  LocalizationOptions o = test_options();
  o.zero_velocity.enabled = false;
  EXPECT_GT(std::sqrt(driven(o, all).estimate().world_from_body.covariance(0, 0)), 3e-3);
}

TEST(LocalizerFaults, StationaryWheelsDoNotHoldASlidingRover) {
  // Vision and IMU measure the motion, the wheels are stationary.
  const TestDrive drive;
  Samples all = test_samples(drive, 62.5, {true, false, false, false}, 50);
  for (double t = 0; t < 62.5; t += 0.05) all.emplace_back(WheelSample{test_stamp(t), 0, 0});
  all = in_order(all, test_motions(drive, 62.5, 1, 51));
  const LocalizationEstimate e = driven(test_options(), all).estimate();
  EXPECT_EQ(e.health_of(LocalizationSensor::wheels).state, SensorState::excluded);
  EXPECT_EQ(e.health_of(LocalizationSensor::vision).state, SensorState::ok);
  expect_consistent(e, all);
}

TEST(LocalizerFaults, SavesAndRestoresItsMemory) {
  const Samples all = whole_drive(22.5, {}, 52);
  const std::size_t half = all.size() / 2;
  Localizer one = driven(test_options(), Samples(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(half)));
  one.add(CompassSample{test_stamp(5), kNan, 0.1});
  Localizer other = Localizer::create(test_options()).value();
  ASSERT_TRUE(other.restore(one.save()).has_value());
  EXPECT_EQ(other.save(), one.save());
  for (std::size_t i = half; i < all.size(); ++i) {
    one.add(all[i]);
    other.add(all[i]);
  }
  EXPECT_EQ(other.save(), one.save());
  EXPECT_EQ(other.estimate().health_of(LocalizationSensor::compass).refused.not_finite, 1);
  EXPECT_EQ(other.estimate().world_from_body.pose.matrix(), one.estimate().world_from_body.pose.matrix());
  Bytes broken = one.save();
  broken[0] = 99;
  EXPECT_FALSE(other.restore(broken).has_value());
  EXPECT_EQ(other.save(), one.save()) << "a refused memory does not change the state";
}

}  // namespace
}  // namespace spartan
