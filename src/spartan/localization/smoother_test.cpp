#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "spartan/localization/internal/drive_test.h"

namespace spartan {
namespace {

using namespace internal;

/// Steps of 0.1 m along x, each with an error of 1 mm, and no errors that last.
std::vector<RelativeMotion> straight(int count) {
  std::vector<RelativeMotion> motions;
  for (int i = 0; i < count; ++i) {
    RelativeMotion m;
    m.from = test_stamp(i);
    m.to = test_stamp(i + 1);
    m.previous_from_current = Pose::from_translation({0.1, 0, 0});
    m.covariance.diagonal() << 1e-6, 1e-6, 1e-6, 1e-16, 1e-16, 1e-16;
    motions.push_back(m);
  }
  return motions;
}

LocalizationOptions white_vision() {
  LocalizationOptions options;
  options.vision.white_noise_factor = 1;
  options.vision.drift_sigma_ratios = options.vision.constant_sigma_ratios = std::vector<double>(6, 0);
  return options;
}

// A position measured after n steps of variance s² with variance r² moves step i by i/n of its share n s²/(n s² + r²),
// and leaves the variance i s² − (i s²)²/(n s² + r²). More frames than are kept in memory at once.
TEST(Smoother, SpreadsALateConstraintOverTheDrive) {
  constexpr int kSteps = 300;
  constexpr double kStep = 1e-6, kMeasured = 1e-4;
  Smoother smoother = Smoother::create(white_vision()).value();
  for (const RelativeMotion& m : straight(kSteps)) smoother.add(m);
  PoseConstraint constraint;
  constraint.stamp = test_stamp(kSteps);
  constraint.world_from_body = Pose::from_translation({0.1 * kSteps + 0.02, -0.01, 0});
  constraint.information.diagonal() << 1 / kMeasured, 1 / kMeasured, 1 / kMeasured, 0, 0, 0;
  LocalizationOptions options = white_vision();
  smoother.add(constraint);
  smoother.start({test_stamp(0), Eigen::Vector3d::UnitX(), {}});
  const std::vector<SmoothedPose> poses = smoother.smooth();
  ASSERT_EQ(poses.size(), std::size_t{kSteps + 1});
  const double r = options.map_factor * kMeasured;
  for (int i = 0; i <= kSteps; i += 25) {
    SCOPED_TRACE(i);
    const SmoothedPose& p = poses[static_cast<std::size_t>(i)];
    EXPECT_EQ(p.stamp, test_stamp(i));
    const double variance = i * kStep, share = variance / (kSteps * kStep + r);
    const Eigen::Vector3d expected(0.1 * i + 0.02 * share, -0.01 * share, 0);
    EXPECT_LT((p.world_from_body.pose.translation() - expected).norm(), 2e-6);
    const double left = variance - variance * share;
    EXPECT_NEAR(p.world_from_body.covariance(1, 1), left, 0.01 * left + 1e-11);
  }
}

std::vector<SmoothedPose> smoothed(const LocalizationOptions& options, const std::vector<Measurement>& all) {
  Smoother smoother = Smoother::create(options).value();
  for (const Measurement& m : std::vector<Measurement>(all.rbegin(), all.rend())) smoother.add(m);  // in any order
  smoother.start({test_stamp(2.5), Eigen::Vector3d::UnitX(), {}});
  return smoother.smooth();
}

TEST(Smoother, EndsAtTheEstimateOfTheFilter) {
  const auto all = in_order(test_samples(TestDrive(), 62.5, {}, 3), test_motions(TestDrive(), 62.5, 1, 3));
  const std::vector<SmoothedPose> poses = smoothed(test_options(), all);
  const UncertainPose filter = driven(test_options(), all).estimate_at(poses.back().stamp)->world_from_body;
  EXPECT_LT(log_se3(poses.back().world_from_body.pose.inverse() * filter.pose).norm(), 1e-9);
  EXPECT_LT((poses.back().world_from_body.covariance - filter.covariance).norm(), 1e-3 * filter.covariance.norm());
}

// The only sample of the compass is of the start, where samples of the IMU with later stamps have had their turn: they
// come earlier by what the clock may be off.
TEST(Smoother, BeginsAsTheLocalizerDoes) {
  LocalizationOptions options = test_options();
  options.imu.time_offset_sigma_s = 0.02;
  auto all = test_samples(TestDrive(), 5, {.compass = false, .inclinometer = false}, 3);
  all.emplace_back(CompassSample{test_stamp(2), 1.0, 0.017});
  Localizer localizer = Localizer::create(options).value();
  Smoother smoother = Smoother::create(options).value();
  for (const Measurement& m : all) {
    smoother.add(m);
    if (stamp_of_measurement(m) <= test_stamp(2)) localizer.add(m);
  }
  localizer.start(test_stamp(2), Eigen::Vector3d::UnitX());
  smoother.start({test_stamp(2), Eigen::Vector3d::UnitX(), {}});
  const Pose by_filter = localizer.estimate().world_from_body.pose;
  EXPECT_GT(by_filter.rotation().angularDistance(Eigen::Quaterniond::Identity()), 0.5);
  EXPECT_LT(log_se3(smoother.smooth().front().world_from_body.pose.inverse() * by_filter).norm(), 1e-5);
}

bool same(const UncertainPose& a, const UncertainPose& b) {
  return log_se3(a.pose.inverse() * b.pose).norm() == 0 && (a.covariance - b.covariance).norm() == 0;
}

// Also those that were refused later on, of an IMU with a clock of its own.
TEST(Smoother, TakesTheInputsOfALocalizerInParts) {
  LocalizationOptions options = test_options();
  options.imu.time_offset_s = 0.02;
  auto all = in_order(test_samples(TestDrive(), 32.5, {}, 3), test_motions(TestDrive(), 32.5, 1, 3));
  Localizer localizer = Localizer::create(options).value();
  localizer.keep_inputs();
  Smoother by_bytes = Smoother::create(options).value(), by_measurements = Smoother::create(options).value();
  int refused = 0;
  for (const Measurement& m : all) {
    if (!localizer.started() && stamp_of_measurement(m) > test_stamp(2.5))
      localizer.start(test_stamp(2.5), Eigen::Vector3d::UnitX());
    if (localizer.add(m)) by_measurements.add(m);
    refused += localizer.add(WheelSample{test_stamp(-100), 0, 0}) ? 0 : 1;
    if (std::holds_alternative<RelativeMotion>(m)) {
      ASSERT_TRUE(by_bytes.add(localizer.take_inputs()));
    }
  }
  EXPECT_GT(refused, 0);
  ASSERT_TRUE(by_bytes.add(localizer.take_inputs()));
  EXPECT_TRUE(by_measurements.smooth().empty()) << "without a start";
  by_measurements.start({test_stamp(2.5), Eigen::Vector3d::UnitX(), {}});
  const std::vector<SmoothedPose> a = by_bytes.smooth(), b = by_measurements.smooth();
  ASSERT_EQ(a.size(), std::size_t{21});
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_TRUE(same(a[i].world_from_body, b[i].world_from_body)) << i;
}

TEST(Smoother, RefusesDamagedInputs) {
  Localizer localizer = Localizer::create(test_options()).value();
  localizer.keep_inputs();
  localizer.add(WheelSample{test_stamp(1), 0, 0});
  // Those that were not taken are saved.
  Localizer restored = Localizer::create(test_options()).value();
  restored.keep_inputs();
  ASSERT_TRUE(restored.restore(localizer.save()));
  const Bytes inputs = localizer.take_inputs();
  EXPECT_EQ(restored.take_inputs(), inputs);
  EXPECT_TRUE(localizer.take_inputs().empty());
  Smoother smoother = Smoother::create(test_options()).value();
  for (std::size_t size = 0; size < inputs.size(); ++size) {
    const Status added = smoother.add(Bytes(inputs.begin(), inputs.begin() + static_cast<std::ptrdiff_t>(size)));
    ASSERT_FALSE(added);
    EXPECT_EQ(added.error().code, ErrorCode::store_damaged);
  }
  Bytes other_version = inputs;
  other_version[0] ^= 1;
  EXPECT_EQ(smoother.add(other_version).error().code, ErrorCode::configuration);
  EXPECT_TRUE(smoother.add(inputs));
}

struct Errors {
  double filter_m2 = 0, smoother_m2 = 0;  ///< mean squares of the positions
  double nees = 0;                        ///< mean of the smoother, 6 degrees of freedom
};

/// Over the frames of drives with other errors each; a map measures the position every 15 s with 0.1 mm.
Errors errors_of(const TestSensors& sensors, int drives) {
  Errors sum;
  double count = 0;
  const TestDrive drive;
  for (int seed = 1; seed <= drives; ++seed) {
    const auto s = static_cast<std::uint64_t>(seed);
    auto all = in_order(test_samples(drive, 62.5, sensors, s), test_motions(drive, 62.5, 1, s));
    Localizer before = Localizer::create(test_options()).value();
    for (const Measurement& m : all) {
      if (stamp_of_measurement(m) <= test_stamp(2.5)) before.add(m);
    }
    before.start(test_stamp(2.5), Eigen::Vector3d::UnitX());
    const Pose first = before.estimate().world_from_body.pose;
    Random random(s, 77);
    for (const double t : {17.5, 32.5, 47.5, 62.5}) {
      PoseConstraint c;
      c.stamp = test_stamp(t);
      c.world_from_body = first * drive.at(2.5).inverse() * drive.at(t) * Pose::from_translation(normal3(random, 1e-4));
      c.information.diagonal().head<3>().setConstant(1e8);
      all.push_back(c);
    }
    std::stable_sort(all.begin(), all.end(), comes_before);
    LocalizationOptions options = test_options();
    options.map_factor = 1;
    const std::vector<SmoothedPose> poses = smoothed(options, all);
    Localizer localizer = Localizer::create(options).value();
    std::size_t frame = 0;
    for (const Measurement& m : all) {
      if (!localizer.started() && stamp_of_measurement(m) > test_stamp(2.5))
        localizer.start(test_stamp(2.5), Eigen::Vector3d::UnitX());
      localizer.add(m);
      if (!std::holds_alternative<RelativeMotion>(m)) continue;
      const UncertainPose filter = localizer.estimate_at(stamp_of_measurement(m))->world_from_body;
      const SmoothedPose& p = poses[++frame];
      EXPECT_EQ(p.stamp, stamp_of_measurement(m));
      const Pose truth = first * drive.at(2.5).inverse() * drive.at(seconds_between(test_stamp(0), p.stamp));
      const auto error = [&](const UncertainPose& of) { return log_se3(of.pose.inverse() * truth); };
      const auto nees = [&](const UncertainPose& of) { return error(of).dot(of.covariance.ldlt().solve(error(of))); };
      sum.filter_m2 += (filter.pose.translation() - truth.translation()).squaredNorm();
      sum.smoother_m2 += (p.world_from_body.pose.translation() - truth.translation()).squaredNorm();
      sum.nees += nees(p.world_from_body);
      ++count;
    }
  }
  return {sum.filter_m2 / count, sum.smoother_m2 / count, sum.nees / count};
}

TEST(Smoother, IsBetterThanTheFilterAndConsistent) {
  for (const TestSensors& sensors : {TestSensors{true, true, true, true}, TestSensors{true, false, false, false},
                                     TestSensors{false, false, false, false}}) {
    SCOPED_TRACE(::testing::Message() << "imu " << sensors.imu << " wheels " << sensors.wheels);
    const Errors e = errors_of(sensors, 8);
    EXPECT_LT(e.smoother_m2, 0.4 * e.filter_m2);
    EXPECT_NEAR(e.nees, 6, 1.5);
  }
}

}  // namespace
}  // namespace spartan
