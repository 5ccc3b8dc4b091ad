// The localization with a real IMU: EuRoC V1_01, 20 s (20 Hz motions of the reference trajectory stand for vision).
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <numbers>

#include "spartan/camera/recording.h"
#include "spartan/localization/localizer.h"
#include "spartan/numerics/random.h"

namespace spartan {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
/// Of the reference at 5 s, rad/s.
const Eigen::Vector3d kGyroBias(-0.00231, 0.02158, 0.07681);

class RealImu : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* const set = std::getenv("SPARTAN_DATA");
    const std::string folder = std::string(set != nullptr ? set : "../shared/data") + "/euroc_v101";
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no euroc_v101 in $SPARTAN_DATA";
    const auto source = open_recording(folder);
    ASSERT_TRUE(source);
    options = with_specified_noise({}, (*source)->info().noise);
    const auto imu = (*source)->imu_samples({}, 1e6);
    const auto truth = load_trajectory((*source)->info().truth_file);
    ASSERT_TRUE(imu && truth);
    poses = truth->poses;
    for (const ImuSample& s : *imu) all.emplace_back(s);
    Random random(11);
    Vector6d sigma;
    sigma << 2e-4, 2e-4, 2e-4, 1.2e-4, 1.2e-4, 1.2e-4;
    for (std::size_t i = 1; i < poses.size(); ++i) {
      RelativeMotion m;
      m.from = poses[i - 1].stamp;
      m.to = poses[i].stamp;
      m.previous_from_current = poses[i - 1].pose.inverse() * poses[i].pose;
      m.covariance = sigma.cwiseAbs2().asDiagonal();
      m.lasting_sigma = Vector6d::Constant(2e-5);
      all.emplace_back(m);
    }
    std::stable_sort(all.begin(), all.end(), comes_before);
  }

  /// Calls `at_frame` with the estimate and the true pose at each frame after the first.
  template <class AtFrame>
  void run(const AtFrame& at_frame) {
    Localizer localizer = Localizer::create(options).value();
    std::size_t frame = 0;
    for (const Measurement& m : all) {
      if (!localizer.started() && stamp_of_measurement(m) > poses[0].stamp) {
        // The camera looks along the body's z; up in its image is the body's x.
        localizer.start(poses[0].stamp, Eigen::Vector3d::UnitZ(), {}, Eigen::Vector3d::UnitX());
      }
      localizer.add(m);
      if (std::holds_alternative<RelativeMotion>(m)) {
        ++frame;
        at_frame(seconds_between(poses[0].stamp, poses[frame].stamp), localizer.estimate(), poses[frame].pose);
      }
    }
  }

  LocalizationOptions options;
  Trajectory poses;
  std::vector<Measurement> all;
};

double tilt_error_deg(const LocalizationEstimate& e, const Pose& truth) {
  const Eigen::Vector3d ours = e.world_from_body.pose.rotation().conjugate() * e.up_in_world,
                        right = truth.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  return kDegrees * std::acos(std::min(1.0, ours.dot(right)));
}

TEST_F(RealImu, IsAlignedAndUsedThroughout) {
  int not_ok = 0;
  double largest_tilt = 0;
  LocalizationEstimate end;
  run([&](double t, const LocalizationEstimate& e, const Pose& truth) {
    not_ok += e.health_of(LocalizationSensor::imu).state == SensorState::ok ? 0 : 1;
    if (t > 5) largest_tilt = std::max(largest_tilt, tilt_error_deg(e, truth));
    if (std::abs(t - 5) < 0.01) {
      EXPECT_LE((e.biases.gyro_rad_s - kGyroBias).norm(), 2e-3);
      EXPECT_LT(e.biases.gyro_sigma_rad_s.maxCoeff(), 1e-3);
    }
    end = e;
  });
  EXPECT_EQ(not_ok, 0);
  EXPECT_LT(largest_tilt, 1);
  EXPECT_GT(end.health_of(LocalizationSensor::imu).used, 3500);
  const Pose moved = poses[0].pose.inverse() * poses.back().pose;
  EXPECT_NEAR(end.world_from_body.pose.translation().norm(), moved.translation().norm(), 0.02);
}

TEST_F(RealImu, BridgesASecondWithoutVision) {
  constexpr double kFrom_s = 12;
  for (Measurement& m : all) {
    auto* motion = std::get_if<RelativeMotion>(&m);
    if (motion == nullptr) continue;
    const double from = seconds_between(poses[0].stamp, motion->from), to = seconds_between(poses[0].stamp, motion->to);
    motion->measured = !(to > kFrom_s && from < kFrom_s + 1);
  }
  std::optional<Pose> before, before_truth;
  run([&](double t, const LocalizationEstimate& e, const Pose& truth) {
    if (t <= kFrom_s) before = e.world_from_body.pose, before_truth = truth;
    if (std::abs(t - kFrom_s - 1) > 0.025) return;
    const Eigen::Vector3d error =
        (before->inverse() * e.world_from_body.pose).translation() - (before_truth->inverse() * truth).translation();
    EXPECT_LT(error.norm(), 0.1);
    EXPECT_LT(error.norm(), 3 * std::sqrt(e.world_from_body.covariance.diagonal().head<3>().sum()));
  });
}

}  // namespace
}  // namespace spartan
