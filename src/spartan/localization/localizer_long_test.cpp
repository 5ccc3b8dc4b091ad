// The covariance over a million steps.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "spartan/localization/internal/drive_test.h"
#include "spartan/localization/internal/error_state_filter.h"

namespace spartan {

using namespace internal;

namespace {

TEST(LocalizerLong, CovarianceStaysPositiveDefiniteOverAMillionSteps) {
  // 10 000 s of IMU at 100 Hz, over a repeated drive, all other sensors at their rates; map constraints
  // every 200 s, an outage of vision of 10 s in each 500 s.
  const TestDrive drive;
  LocalizationOptions options = test_options();
  options.vision = LocalizationOptions().vision;
  ErrorStateFilter filter(options);
  std::vector<Measurement> before = test_samples(drive, 2.5, {}, 61);
  filter.start(test_stamp(2.5), Eigen::Vector3d::UnitX(), before);
  Random random(62);
  double rolled = 0;
  Pose last = drive.at(2.5);
  double frame = 2.5;
  constexpr int kSteps = 1'000'000;
  for (int i = 251; i < 251 + kSteps; ++i) {
    const double t = i * 0.01;
    ImuSample imu = drive.imu(t);
    imu.gyro_rad_s += normal3(random, 1e-3);
    imu.accel_m_s2 += normal3(random, 1e-2);
    filter.process(imu);
    const Pose now = drive.at(t);
    rolled += (now.translation() - last.translation()).norm();
    last = now;
    if (i % 150 == 100) {
      RelativeMotion motion = drive.motion(frame, t, test_motion_covariance());
      for (int k = 0; k < 6; ++k) {
        motion.previous_from_current = motion.previous_from_current * exp_se3(Vector6d::Unit(k) * random.normal() *
                                                                              std::sqrt(motion.covariance(k, k)));
      }
      motion.measured = i % 50'000 > 1000;
      filter.process(motion);
      frame = t;
    }
    if (i % 5 == 0) filter.process(WheelSample{test_stamp(t), rolled / 0.98, rolled / 0.98});
    if (i % 100 == 0) filter.process(CompassSample{test_stamp(t), heading_of(now) + random.normal(0, 0.017), 0.017});
    if (i % 20 == 0) {
      const Eigen::Vector2d tilt = roll_pitch_of_up(now.rotation().conjugate() * Eigen::Vector3d::UnitZ());
      filter.process(InclinometerSample{test_stamp(t), tilt.x() + random.normal(0, 0.0035),
                                        tilt.y() + random.normal(0, 0.0035), 0.0035});
    }
    if (i % 20'000 == 0)
      filter.process(PoseConstraint{test_stamp(t), drive.at(2.5).inverse() * now, 1e6 * Matrix6d::Identity()});
    if (i % 10'000 != 0) continue;
    const ErrorCovariance& p = filter.memory().estimate.covariance;
    ASSERT_TRUE(p.allFinite()) << i;
    ASSERT_LE((p - p.transpose()).cwiseAbs().maxCoeff(), 1e-12 * p.cwiseAbs().maxCoeff()) << i;
    // Clones may coincide with the pose, so that the full covariance is semidefinite; without them it is definite.
    const auto own = p.topLeftCorner<error_at::kVisionClone, error_at::kVisionClone>().eval();
    ASSERT_EQ(own.llt().info(), Eigen::Success) << i;
    const Eigen::SelfAdjointEigenSolver<ErrorCovariance> eigen(p, Eigen::EigenvaluesOnly);
    ASSERT_GE(eigen.eigenvalues()[0], -1e-13 * eigen.eigenvalues()[error_at::kSize - 1]) << i;
  }
  const Pose truth = drive.at(2.5).inverse() * last;
  EXPECT_LE((filter.memory().estimate.state.world_from_body.translation() - truth.translation()).norm(), 0.05);
  EXPECT_GT(rolled, 500);
}

}  // namespace
}  // namespace spartan
