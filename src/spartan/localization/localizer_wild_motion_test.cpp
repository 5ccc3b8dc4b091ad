// Visual motions that are far off, with their usual covariance.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "spartan/localization/internal/drive_test.h"

namespace spartan {
namespace {

using namespace internal;

/// The 99.73 % quantile of chi-square with 3 degrees of freedom.
constexpr double kThreeSigma = 14.156;

struct Trial {
  std::vector<Measurement> all;
  Pose first;  ///< of the localizer
};

double position_nees(const LocalizationEstimate& e, const Pose& first) {
  const TestDrive drive;
  const Pose truth = first * drive.at(2.5).inverse() * drive.at(seconds_between(test_stamp(0), e.stamp));
  const Eigen::Vector3d error = log_se3(e.world_from_body.pose.inverse() * truth).head<3>();
  return error.dot(e.world_from_body.covariance.topLeftCorner<3, 3>().ldlt().solve(error));
}

/// After `from` and at most at `to`.
bool within_s(Stamp stamp, double from, double to) {
  return stamp > test_stamp(from) && stamp <= test_stamp(to);
}

/// The `count` motions from 30 s on are off by 0.5 m and 5° in a random direction.
Trial with_wild_motions(const TestSensors& sensors, int count, std::uint64_t seed) {
  Trial trial{in_order(test_samples(TestDrive(), 62.5, sensors, seed), test_motions(TestDrive(), 62.5, 1, seed)), {}};
  Random random(seed, 5);
  for (Measurement& m : trial.all) {
    auto* motion = std::get_if<RelativeMotion>(&m);
    if (motion == nullptr || motion->from < test_stamp(30) || count-- <= 0) continue;
    Vector6d error;
    error << 0.5 * normal3(random, 1).normalized(), 0.087 * normal3(random, 1).normalized();
    motion->previous_from_current = motion->previous_from_current * exp_se3(error);
  }
  Localizer localizer = Localizer::create(test_options()).value();
  for (const Measurement& m : trial.all) {
    if (stamp_of_measurement(m) <= test_stamp(2.5)) localizer.add(m);
  }
  localizer.start(test_stamp(2.5), Eigen::Vector3d::UnitX());
  trial.first = localizer.estimate().world_from_body.pose;
  return trial;
}

TEST(LocalizerWildMotion, OneIsRejectedWithAnyWitness) {
  for (const TestSensors& sensors : {TestSensors{true, false, false, false}, TestSensors{false, true, false, false},
                                     TestSensors{true, true, false, false}, TestSensors{true, true, true, true}}) {
    SCOPED_TRACE(::testing::Message() << "imu " << sensors.imu << " wheels " << sensors.wheels);
    int inside = 0;
    constexpr int kTrials = 10;
    for (std::uint64_t seed = 1; seed <= kTrials; ++seed) {
      const Trial trial = with_wild_motions(sensors, 1, seed);
      const LocalizationEstimate end = driven(test_options(), trial.all).estimate();
      EXPECT_EQ(end.health_of(LocalizationSensor::vision).rejected, 1);
      EXPECT_EQ(end.health_of(LocalizationSensor::vision).state, SensorState::ok);
      EXPECT_EQ(end.health_of(LocalizationSensor::imu).rejected, 0);
      inside += position_nees(end, trial.first) < kThreeSigma ? 1 : 0;
    }
    EXPECT_EQ(inside, kTrials);
  }
}

// A compass or an inclinometer do not see it. No rover jumps by 0.5 m between steps of 0.15 m: the motion is used with
// its size as standard deviation.
TEST(LocalizerWildMotion, IsUncertainWithoutAWitness) {
  for (const TestSensors& sensors : {TestSensors{false, false, false, false}, TestSensors{false, false, true, false},
                                     TestSensors{false, false, false, true}, TestSensors{false, false, true, true}}) {
    SCOPED_TRACE(::testing::Message() << "compass " << sensors.compass << " inclinometer " << sensors.inclinometer);
    constexpr int kTrials = 10;
    for (std::uint64_t seed = 1; seed <= kTrials; ++seed) {
      const Trial trial = with_wild_motions(sensors, 1, seed);
      const LocalizationEstimate end = driven(test_options(), trial.all).estimate();
      EXPECT_LT(position_nees(end, trial.first), kThreeSigma);
      EXPECT_GT(position_nees(end, trial.first), 1e-3);
      EXPECT_LE(end.health_of(LocalizationSensor::vision).rejected, sensors.inclinometer ? 1 : 0);
      EXPECT_EQ(end.health_of(LocalizationSensor::vision).state, SensorState::ok);
    }
  }
}

TEST(LocalizerWildMotion, AnInclinometerSeesARotation) {
  for (const double roll_rad : {0.0, 0.087}) {
    Trial trial = with_wild_motions({false, false, false, true}, 0, 5);
    for (Measurement& m : trial.all) {
      auto* motion = std::get_if<RelativeMotion>(&m);
      if (motion == nullptr || !within_s(motion->to, 30, 32.5)) continue;
      motion->previous_from_current = motion->previous_from_current * exp_se3(Vector6d::Unit(3) * roll_rad);
    }
    const LocalizationEstimate end = driven(test_options(), trial.all).estimate();
    EXPECT_EQ(end.health_of(LocalizationSensor::vision).rejected, roll_rad > 0 ? 1 : 0);
    EXPECT_LT(position_nees(end, trial.first), kThreeSigma);
  }
}

// Neither a stop, with frames or without, nor frames that are shown again make the next motion implausible.
TEST(LocalizerWildMotion, AStartAfterAStopIsPlausible) {
  for (const bool frames_at_stop : {false, true}) {
    for (const double way_m : {0.15, 1.2}) {  // as before the stop, or all the way that a rover at its speed has driven
      Localizer localizer = Localizer::create(test_options()).value();
      localizer.start(test_stamp(0), Eigen::Vector3d::UnitX());
      double t = 0;
      const auto move = [&](double seconds, double metres) {
        RelativeMotion m;
        m.from = test_stamp(t);
        m.to = test_stamp(t += seconds);
        m.previous_from_current = Pose::from_translation({metres, 0, 0});
        m.covariance.diagonal().setConstant(1e-8);
        localizer.add(m);
      };
      for (int i = 0; i < 10; ++i) move(2.5, 0.15);
      for (int i = 0; i < 8 && frames_at_stop; ++i) move(2.5, 0);
      move(frames_at_stop ? 2.5 : 22.5, way_m);
      const LocalizationEstimate e = localizer.estimate();
      EXPECT_EQ(e.health_of(LocalizationSensor::vision).reason, "");
      EXPECT_LT(e.world_from_body.covariance.diagonal().head<3>().maxCoeff(), 1e-4);
    }
  }
}

TEST(LocalizerWildMotion, WithoutAWitnessItIsSaidInTheHealth) {
  const Trial trial = with_wild_motions({false, false, false, false}, 1, 3);
  std::vector<Measurement> until;
  std::copy_if(trial.all.begin(), trial.all.end(), std::back_inserter(until),
               [](const Measurement& m) { return stamp_of_measurement(m) <= test_stamp(32.6); });
  const SensorHealth vision = driven(test_options(), until).estimate().health_of(LocalizationSensor::vision);
  EXPECT_EQ(vision.state, SensorState::suspect);
  EXPECT_EQ(vision.reason, "its motion is far off what those before it predict, and no other sensor confirms it");
}

TEST(LocalizerWildMotion, IsSaidInTheHealth) {
  const Trial trial = with_wild_motions({true, false, false, false}, 1, 3);
  std::vector<Measurement> until;
  std::copy_if(trial.all.begin(), trial.all.end(), std::back_inserter(until),
               [](const Measurement& m) { return stamp_of_measurement(m) <= test_stamp(32.6); });
  const SensorHealth vision = driven(test_options(), until).estimate().health_of(LocalizationSensor::vision);
  EXPECT_EQ(vision.state, SensorState::suspect);
  EXPECT_EQ(vision.reason, "its motion contradicts the IMU or the wheels by far");
}

// A motion that was rejected before a lost frame does not move the frames after it.
TEST(LocalizerWildMotion, ALostFrameEndsTheDoubt) {
  Trial trial = with_wild_motions({true, false, false, false}, 1, 6);
  for (Measurement& m : trial.all) {
    auto* motion = std::get_if<RelativeMotion>(&m);
    if (motion == nullptr) continue;
    if (within_s(motion->to, 32.5, 34)) motion->measured = false;
    // Contradicted after the lost frame, too.
    if (within_s(motion->to, 34, 35.5))
      motion->previous_from_current = motion->previous_from_current * Pose::from_translation({0, 0.3, 0});
  }
  const LocalizationEstimate end = driven(test_options(), trial.all).estimate();
  EXPECT_EQ(end.health_of(LocalizationSensor::vision).rejected, 3) << "wild, lost, wild";
  EXPECT_LT(position_nees(end, trial.first), kThreeSigma);
}

// The second contradiction in a row is the IMU's: the motion that was rejected is accepted after all.
TEST(LocalizerWildMotion, AMotionThatWasRightIsAcceptedLate) {
  Trial trial = with_wild_motions({true, false, false, false}, 0, 4);
  for (Measurement& m : trial.all) {
    auto* imu = std::get_if<ImuSample>(&m);
    if (imu != nullptr && imu->stamp > test_stamp(30)) imu->gyro_rad_s.z() += 0.5;
  }
  const LocalizationEstimate end = driven(test_options(), trial.all).estimate();
  EXPECT_EQ(end.health_of(LocalizationSensor::vision).rejected, 1);
  EXPECT_EQ(end.health_of(LocalizationSensor::vision).state, SensorState::ok);
  EXPECT_EQ(end.health_of(LocalizationSensor::imu).state, SensorState::excluded);
  const TestDrive drive;
  const Pose truth = trial.first * drive.at(2.5).inverse() * drive.at(seconds_between(test_stamp(0), end.stamp));
  EXPECT_LT((end.world_from_body.pose.translation() - truth.translation()).norm(), 0.02);
}

}  // namespace
}  // namespace spartan
