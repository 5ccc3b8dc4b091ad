#include "spartan/localization/localizer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <optional>

#include "spartan/localization/internal/chi_square.h"
#include "spartan/localization/internal/drive_test.h"
#include "spartan/testing/text_checks.h"

namespace spartan {

using namespace internal;

namespace {

double normalised_error(const UncertainPose& estimate, const Pose& truth) {
  const Vector6d e = log_se3(estimate.pose.inverse() * truth);
  return e.dot(estimate.covariance.inverse() * e);
}

// The pose relative to the first one, at which the world starts.
Pose true_pose(const TestDrive& drive, double t) {
  return drive.at(2.5).inverse() * drive.at(t);
}

TEST(Localizer, ComposesTheMotionsOfVisionAlone) {
  const TestDrive drive;
  const auto motions = test_motions(drive, 100, 1, 3);
  const Localizer localizer = driven(test_options(), motions);
  UncertainPose expected{Pose(), 1e-12 * Matrix6d::Identity()};
  for (const Measurement& m : motions) {
    const auto& motion = std::get<RelativeMotion>(m);
    expected = compose(expected, {motion.previous_from_current, motion.covariance});
  }
  const LocalizationEstimate e = localizer.estimate();
  EXPECT_LE(log_se3(e.world_from_body.pose.inverse() * expected.pose).norm(), 1e-7);
  EXPECT_LE(log_se3(e.odom_from_body.pose.inverse() * expected.pose).norm(), 1e-7);
  EXPECT_LE((e.world_from_body.covariance - expected.covariance).norm(), 1e-4 * expected.covariance.norm());
  EXPECT_LE((e.odom_from_body.covariance - expected.covariance).norm(), 1e-4 * expected.covariance.norm());
  EXPECT_FALSE(e.heading.east);
  EXPECT_FALSE(e.gravity_measured);
  EXPECT_EQ(e.health_of(LocalizationSensor::vision).state, SensorState::ok);
  EXPECT_EQ(e.health_of(LocalizationSensor::imu).state, SensorState::missing);
}

// Σ_ij a^|i−j| over n equal steps: the variance of their sum if neighbours are correlated by a.
double correlated_sum(int n, double a) {
  double sum = n;
  for (int k = 1; k < n; ++k) sum += 2 * (n - k) * std::pow(a, k);
  return sum;
}

// Vision alone: ten frames stationary, a gap, then equal motions straight ahead. Their sum and its variance have a
// closed form, with the drift of vision too.
TEST(Localizer, FollowsVisionAloneAfterAStop) {
  constexpr double kPeriod_s = 0.1;
  constexpr int kStops = 10, kMoves = 8;
  const LocalizationOptions options;
  for (const int dropped : {0, 10, 100}) {
    for (const double step_m : {1e-4, 1e-3, 0.01, 0.1, 1.0, 10.0}) {
      for (const double sigma_m : {1e-5, 1e-3, 0.02}) {
        SCOPED_TRACE(::testing::Message() << dropped << " dropped, " << step_m << " m, sigma " << sigma_m);
        Localizer localizer = Localizer::create(options).value();
        localizer.start(test_stamp(0), Eigen::Vector3d::UnitX());
        RelativeMotion motion;
        motion.measured = true;
        motion.covariance = (sigma_m * sigma_m) * Matrix6d::Identity();
        motion.covariance.diagonal().tail<3>().setConstant(1e-10);
        double t = 0;
        const auto add = [&](double x, double seconds) {
          motion.from = test_stamp(t);
          motion.to = test_stamp(t += seconds);
          motion.previous_from_current = Pose::from_translation({x, 0, 0});
          ASSERT_TRUE(localizer.add(motion));
        };
        for (int i = 0; i < kStops; ++i) add(0, kPeriod_s);
        const UncertainPose stopped = localizer.estimate().world_from_body;
        for (int i = 0; i < kMoves; ++i) add(step_m, i == 0 ? kPeriod_s * (1 + dropped) : kPeriod_s);

        const LocalizationEstimate e = localizer.estimate();
        const double variance =
            sigma_m * sigma_m *
            (options.vision.white_noise_factor * kMoves +
             std::pow(options.vision.drift_sigma_ratios[0], 2) *
                 correlated_sum(kMoves, std::exp(-1 / options.vision.drift_correlation_frames)) +
             std::pow(options.vision.constant_sigma_ratios[0], 2) * correlated_sum(kMoves, std::exp(-1 / 5000.0)));
        const double error_m = e.world_from_body.pose.translation().x() - kMoves * step_m;
        // Steps below the noise of the constant-velocity model are partly predicted.
        const bool large = step_m >= 0.1;
        EXPECT_LT(std::abs(error_m), (large ? 0.1 : 0.5) * std::sqrt(variance));
        const double added = e.world_from_body.covariance(0, 0) - stopped.covariance(0, 0);
        EXPECT_LT(added, 1.1 * variance);
        if (large) {
          EXPECT_GT(added, 0.9 * variance);
        }
        EXPECT_EQ(e.health_of(LocalizationSensor::vision).state, SensorState::ok);
      }
    }
  }
}

// The last pose relative to the pose after `from` motions.
struct Revisit {
  Eigen::Index from = 0;
  Pose from_last;
  Matrix6d information;
};

// Gauss-Newton over all poses with the same motions and pose constraints.
UncertainPose batch(const std::vector<Measurement>& motions, const std::vector<PoseConstraint>& constraints,
                    const std::optional<Revisit>& revisit = {}) {
  std::vector<Pose> x{Pose()};
  for (const Measurement& m : motions) x.push_back(x.back() * std::get<RelativeMotion>(m).previous_from_current);
  const auto n = static_cast<Eigen::Index>(x.size());
  Eigen::MatrixXd a;
  for (int round = 0; round < 6; ++round) {
    a = Eigen::MatrixXd::Zero(6 * n, 6 * n);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(6 * n);
    const auto add = [&](Eigen::Index i, const Matrix6d& ji, Eigen::Index k, const Matrix6d& jk, const Vector6d& r,
                         const Matrix6d& w) {
      a.block<6, 6>(6 * i, 6 * i) += ji.transpose() * w * ji;
      b.segment<6>(6 * i) += ji.transpose() * w * r;
      if (k == i) return;
      a.block<6, 6>(6 * k, 6 * k) += jk.transpose() * w * jk;
      a.block<6, 6>(6 * i, 6 * k) += ji.transpose() * w * jk;
      a.block<6, 6>(6 * k, 6 * i) += jk.transpose() * w * ji;
      b.segment<6>(6 * k) += jk.transpose() * w * r;
    };
    const Matrix6d identity = Matrix6d::Identity();
    add(0, identity, 0, identity, log_se3(x[0].inverse()), 1e12 * identity);
    for (Eigen::Index i = 0; i + 1 < n; ++i) {
      const auto& m = std::get<RelativeMotion>(motions[static_cast<std::size_t>(i)]);
      const Pose between = x[static_cast<std::size_t>(i)].inverse() * x[static_cast<std::size_t>(i + 1)];
      const Vector6d r = log_se3(between.inverse() * m.previous_from_current);
      const Matrix6d j = right_jacobian_se3(r);
      add(i + 1, identity, i, -right_jacobian_inverse_se3(-r) * adjoint(between.inverse()), r,
          j.transpose() * m.covariance.inverse() * j);
    }
    for (const PoseConstraint& c : constraints) {
      for (Eigen::Index i = 1; i < n; ++i) {
        if (std::get<RelativeMotion>(motions[static_cast<std::size_t>(i - 1)]).to != c.stamp) continue;
        add(i, identity, i, identity, log_se3(x[static_cast<std::size_t>(i)].inverse() * c.world_from_body),
            c.information);
      }
    }
    if (revisit) {
      const Pose between = x[static_cast<std::size_t>(revisit->from)].inverse() * x.back();
      const Vector6d r = log_se3(between.inverse() * revisit->from_last);
      add(n - 1, identity, revisit->from, -right_jacobian_inverse_se3(-r) * adjoint(between.inverse()), r,
          revisit->information);
    }
    const Eigen::VectorXd step = a.ldlt().solve(b);
    for (Eigen::Index i = 0; i < n; ++i)
      x[static_cast<std::size_t>(i)] = x[static_cast<std::size_t>(i)] * exp_se3(step.segment<6>(6 * i));
  }
  return {x.back(), a.inverse().bottomRightCorner<6, 6>()};
}

TEST(Localizer, AgreesWithBatchLeastSquares) {
  const TestDrive drive;
  const auto motions = test_motions(drive, 40, 1, 5);
  std::vector<PoseConstraint> constraints;
  Random random(9);
  std::vector<Measurement> all = motions;
  for (const std::size_t at : {4u, 11u, 19u}) {
    const Stamp stamp = stamp_of_measurement(motions[at]);
    Vector6d error;
    for (int i = 0; i < 6; ++i) error[i] = random.normal(0, 1e-4);
    Matrix6d information = Matrix6d::Identity() * 1e8;
    information(2, 2) = information(3, 3) = 0;  // nothing on height and roll
    const double t = seconds_between(test_stamp(0), stamp);
    constraints.push_back({stamp, true_pose(drive, t) * exp_se3(error), information});
    all.emplace_back(constraints.back());
  }
  std::stable_sort(all.begin(), all.end(), comes_before);
  const LocalizationEstimate e = driven(test_options(), all).estimate();
  const UncertainPose expected = batch(motions, constraints);
  EXPECT_EQ(e.health_of(LocalizationSensor::map).used, 3);
  EXPECT_LE(log_se3(e.world_from_body.pose.inverse() * expected.pose).norm(), 1e-6);
  EXPECT_LE((e.world_from_body.covariance - expected.covariance).norm(), 1e-3 * expected.covariance.norm());
}

TEST(Localizer, MapOfAnEarlierPoseEqualsARelativeMotion) {
  const TestDrive drive;
  const auto motions = test_motions(drive, 40, 1, 5);
  constexpr std::size_t kMapped = 12;
  const Stamp end = stamp_of_measurement(motions.back());
  const std::vector<Measurement> until(motions.begin(), motions.begin() + kMapped);
  const UncertainPose mapped = driven(test_options(), until).estimate().world_from_body;
  const Pose moved = true_pose(drive, seconds_between(test_stamp(0), stamp_of_measurement(until.back()))).inverse() *
                     true_pose(drive, seconds_between(test_stamp(0), end));
  Vector6d error;
  error << 2e-4, -1e-4, 1e-4, 1e-4, -2e-4, 1e-4;
  Matrix6d information = Matrix6d::Zero();
  information.diagonal() << 1e6, 2e6, 1e6, 2e6, 1e6, 3e6;
  const Revisit revisit{kMapped, moved * exp_se3(error), information};
  const Matrix6d carry = adjoint(revisit.from_last.inverse());
  std::vector<Measurement> all = motions;
  all.emplace_back(
      PoseConstraint{end, mapped.pose * revisit.from_last, information, carry * mapped.covariance * carry.transpose()});
  const LocalizationEstimate e = driven(test_options(), all).estimate();
  const UncertainPose expected = batch(motions, {}, revisit), before = batch(motions, {});
  EXPECT_LE(log_se3(e.world_from_body.pose.inverse() * expected.pose).norm(),
            0.01 * log_se3(before.pose.inverse() * expected.pose).norm());
  EXPECT_LE((e.world_from_body.covariance - expected.covariance).norm(), 0.01 * expected.covariance.norm());
}

TEST(Localizer, MapConstraintOnTheLastFrameIsAppliedHoweverLate) {
  const TestDrive drive;
  LocalizationOptions short_buffer = test_options(), long_buffer = test_options();
  short_buffer.buffer_s = 2;
  long_buffer.buffer_s = 60;
  // Later samples correct the clock, which is not linear: 6 % of the correction with a standard deviation of 10 ms.
  short_buffer.imu.time_offset_sigma_s = long_buffer.imu.time_offset_sigma_s = 0.001;
  for (const TestSensors& with : {TestSensors{}, TestSensors{false, true, false, false, 1}}) {
    const auto motions = test_motions(drive, 22, 1, 22);
    const auto all = in_order(test_samples(drive, 31, with, 21), motions);
    const Stamp frame = stamp_of_measurement(motions.back());
    const auto until =
        std::find_if(all.begin(), all.end(), [&](const auto& m) { return stamp_of_measurement(m) > frame; });
    const Localizer at_frame = driven(test_options(), {all.begin(), until});
    Localizer late = driven(short_buffer, all), replayed = driven(long_buffer, all);
    const Pose seen = at_frame.estimate().world_from_body.pose * Pose::from_translation({1e-4, -2e-4, 0});
    Matrix6d information = 1e4 * Matrix6d::Identity();
    information(1, 1) = 1e8;
    const Pose before = late.estimate().world_from_body.pose;
    EXPECT_FALSE(late.add(PoseConstraint{{frame.ns + 1}, seen, information})) << "no frame has that stamp";
    ASSERT_TRUE(late.add(PoseConstraint{frame, seen, information}));
    ASSERT_TRUE(replayed.add(PoseConstraint{frame, seen, information}));
    const LocalizationEstimate a = late.estimate(), b = replayed.estimate();
    EXPECT_EQ(a.health_of(LocalizationSensor::map).used, 1);
    const double moved = log_se3(before.inverse() * b.world_from_body.pose).norm();
    EXPECT_GT(moved, 1e-4);
    EXPECT_LE(log_se3(a.world_from_body.pose.inverse() * b.world_from_body.pose).norm(), 0.05 * moved);
    EXPECT_LE((a.world_from_body.covariance - b.world_from_body.covariance).norm(),
              0.05 * b.world_from_body.covariance.norm());
    // A frame that arrives even later, with an earlier stamp, is processed after the constraint.
    const auto next = drive.motion(seconds_between(test_stamp(0), frame), 30, test_motion_covariance());
    ASSERT_TRUE(late.add(next));
    ASSERT_TRUE(replayed.add(next));
    EXPECT_EQ(late.estimate().health_of(LocalizationSensor::map).used, 1);
    EXPECT_LE(log_se3(late.estimate().world_from_body.pose.inverse() * replayed.estimate().world_from_body.pose).norm(),
              0.05 * moved);
    EXPECT_FALSE(late.add(PoseConstraint{frame, seen, information})) << "it is no longer the last frame";
  }
}

TEST(Localizer, EverySubsetOfSensorsIsConsistent) {
  const TestDrive drive;
  const double limit = chi_square_quantile(0.999, 6);
  for (int mask = 0; mask < 16; ++mask) {
    SCOPED_TRACE(mask);
    const TestSensors with{(mask & 1) != 0, (mask & 2) != 0, (mask & 4) != 0, (mask & 8) != 0, 1};
    const auto all = in_order(test_samples(drive, 62.6, with, 11), test_motions(drive, 62.5, 1, 12));
    const LocalizationEstimate e = driven(test_options(), all).estimate();
    const double t = seconds_between(test_stamp(0), e.stamp);
    EXPECT_LE((e.world_from_body.pose.translation() - e.world_from_odom * e.odom_from_body.pose.translation()).norm(),
              1e-9);
    // Yaw and level of the world follow from the first readings; the truth is relative to the first pose.
    Localizer at_start = Localizer::create(test_options()).value();
    for (const Measurement& m : all) {
      if (stamp_of_measurement(m) <= test_stamp(2.5)) at_start.add(m);
    }
    at_start.start(test_stamp(2.5), Eigen::Vector3d::UnitX());
    const Pose start = at_start.estimate().world_from_body.pose;
    EXPECT_LE(normalised_error(e.world_from_body, start * true_pose(drive, t)), limit);
    const auto state = [&](LocalizationSensor s) { return e.health_of(s).state; };
    EXPECT_EQ(state(LocalizationSensor::imu), with.imu ? SensorState::ok : SensorState::missing);
    EXPECT_EQ(state(LocalizationSensor::wheels), with.wheels ? SensorState::ok : SensorState::missing);
    EXPECT_EQ(e.heading.east, with.compass);
    EXPECT_EQ(e.gravity_measured, with.imu || with.inclinometer);
  }
}

TEST(Localizer, AlignsTheWorldToGravityAndEast) {
  Localizer localizer = Localizer::create(test_options()).value();
  const Eigen::Quaterniond tilted = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitX());
  for (int i = 0; i < 200; ++i) {
    localizer.add(ImuSample{test_stamp(i * 0.01), Eigen::Vector3d::Zero(),
                            tilted.conjugate() * Eigen::Vector3d(0, 0, 3.71 + (i % 2 == 0 ? 1e-4 : -1e-4))});
    if (i % 50 == 0) localizer.add(CompassSample{test_stamp(i * 0.01), i == 50 ? -2.0 : 0.7, 0.01});
  }
  localizer.start(test_stamp(2), Eigen::Vector3d::UnitX());
  const LocalizationEstimate e = localizer.estimate();
  EXPECT_TRUE(e.heading.east);
  EXPECT_LE(log_so3(e.world_from_body.pose.rotation().conjugate() * tilted).norm(), 1e-6);
  EXPECT_THROW(localizer.start(test_stamp(3), Eigen::Vector3d::UnitX()), std::logic_error);
}

TEST(Localizer, OdomDoesNotJumpIfTheMapCorrectsTheWorld) {
  const TestDrive drive;
  const auto all = in_order(test_samples(drive, 62.5, {}, 21), test_motions(drive, 62.5, 1, 22));
  Localizer with = driven(test_options(), all), without = driven(test_options(), all);
  const LocalizationEstimate before = with.estimate();
  const double aside = 3 * std::sqrt(before.world_from_body.covariance(1, 1));
  const Pose seen = before.world_from_body.pose * Pose::from_translation({0, aside, 0});
  Matrix6d side_only = Matrix6d::Zero();
  side_only(1, 1) = 1e12;
  ASSERT_TRUE(with.add(PoseConstraint{before.stamp, seen, side_only}));
  const LocalizationEstimate after = with.estimate();
  EXPECT_NEAR((before.world_from_body.pose.inverse() * after.world_from_body.pose).translation().y(), aside,
              0.05 * aside);
  EXPECT_LE(log_se3(after.odom_from_body.pose.inverse() * before.odom_from_body.pose).norm(), 1e-12);
  EXPECT_LE(log_se3((after.world_from_odom * after.odom_from_body.pose).inverse() * after.world_from_body.pose).norm(),
            1e-12);
  // And continues as without the constraint.
  for (const Measurement& m : test_motions(drive, 71.5, 1, 22)) {
    if (std::get<RelativeMotion>(m).from < before.stamp) continue;
    with.add(m);
    without.add(m);
  }
  const Pose a = before.odom_from_body.pose.inverse() * with.estimate().odom_from_body.pose;
  const Pose b = before.odom_from_body.pose.inverse() * without.estimate().odom_from_body.pose;
  EXPECT_GT(a.translation().norm(), 0.3);
  EXPECT_LE(log_se3(a.inverse() * b).norm(), 0.05 * aside);
}

TEST(Localizer, RefusesOptionsOutOfBounds) {
  LocalizationOptions options;
  options.map_factor = 0;
  const std::string expected = "localization options: map_factor is 0, must be between 0.01 and 10000";
  EXPECT_THAT(testing::error_message(Localizer::create(options)), ::testing::HasSubstr(expected));
  EXPECT_THAT(testing::error_message(VisionOnlyFilter::create(options)), ::testing::HasSubstr(expected));
  options = {};
  options.gravity_m_s2 = 0;
  EXPECT_EQ(testing::error_message(Localizer::create(options)),
            "localization options: gravity_m_s2: 0 is not a positive number");
}

}  // namespace
}  // namespace spartan
