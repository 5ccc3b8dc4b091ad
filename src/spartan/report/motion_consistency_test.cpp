#include <gtest/gtest.h>

#include <filesystem>

#include "spartan/core/options.h"
#include "spartan/numerics/random.h"
#include "spartan/report/report.h"
#include "spartan/rig/rig.h"
#include "spartan/system/run_folder.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

constexpr int kFrames = 900;
constexpr double kStep_m = 0.1;

Rig pitched_pair() {
  Camera left, right;
  left.name = "left";
  right.name = "right";
  left.size = right.size = {640, 480};
  left.model = right.model = PinholeModel{500, 500, 320, 240};
  const Pose body_from_left = Pose(exp_so3({0.1, 0.6, 0}), {0.3, 0.06, 0.8}) * optical_from_forward().inverse();
  // Turned outwards: the rectified left camera has other axes than the left one.
  const Pose right_from_left(exp_so3({0, 0.05, 0}), {-0.12, 0.01, 0});
  Rig rig = rig_of_one_pair("rig", left, right, right_from_left);
  rig.convention = PoseConvention::body;
  rig.cameras[0].mount_from_camera = body_from_left;
  rig.cameras[1].mount_from_camera = body_from_left * right_from_left.inverse();
  return rig;
}

// A drive along an arc whose visual motions have errors of known covariance, in the rectified left camera.
class Consistency : public ::testing::Test {
 protected:
  Consistency() {
    deviations_ << 4e-4, 2e-4, 3e-4, 1e-4, 2e-4, 5e-5;
    const RectifyingAxes axes = rectifying_axes(rig_.right_from_left(rig_.pairs[0]));
    body_from_rectified_ = rig_.body_from_camera("left") * Pose(axes.left_from_rectified, Eigen::Vector3d::Zero());
    folder_.write("rig.yaml", to_rig_yaml(rig_));
    options_.mapping.map.calibration = {{0, 0, 0, 0, 0}};
    options_.localization.vision.white_noise_factor = 1;
    options_.localization.vision.drift_sigma_ratios =
        options_.localization.vision.constant_sigma_ratios = {0, 0, 0, 0, 0, 0};
  }
  static Stamp stamp_of(int i) { return Stamp{1'000'000'000 + 100'000'000LL * i}; }

  // `shared`: an error of all motions, in standard deviations of each.
  void write_run(const Vector6d& shared = Vector6d::Zero(), int lost = -1) {
    Random random(7);
    folder_.write("config.yaml", dump_options(options_));
    auto store = RunStore::create(folder_.file("run.sqlite"), {});
    ASSERT_TRUE(store.has_value());
    const Pose step = exp_se3((Vector6d() << kStep_m, 0.004, 0, 0, 0.002, 0.01).finished());
    Pose body;
    for (int i = 0; i < kFrames; ++i) {
      if (i > 0) body = body * step;
      truth_.push_back({stamp_of(i), body});
      FrameRecord frame;
      frame.frame_id = i;
      frame.pair = rig_.pairs[0].name;
      frame.stamp = frame.motion.to = stamp_of(i);
      frame.motion.first = i == 0;
      frame.has_pose = i != lost;
      frame.status = frame.has_pose ? "tracking" : "lost";
      if (i > 0) {
        // The motion after the lost frame spans it.
        const int from = i == lost + 1 && lost >= 0 ? i - 2 : i - 1;
        Vector6d error = shared;
        for (int k = 0; k < 6; ++k) error[k] += random.normal();
        const Pose motion = i - from == 2 ? step * step : step;
        frame.motion.from = stamp_of(from);
        frame.motion.previous_from_current =
            body_from_rectified_.inverse() * motion * body_from_rectified_ * exp_se3(deviations_.cwiseProduct(error));
        frame.motion.covariance = deviations_.cwiseAbs2().asDiagonal();
      }
      ASSERT_TRUE(store->commit({RunStore::Step{frame, {}, {}, {}}}).has_value());
    }
  }
  Result<MotionConsistency> consistency(std::vector<double> lengths_m) const {
    return motion_consistency(folder_.path(), truth_, 0.02, std::move(lengths_m));
  }

  testing::TemporaryFolder folder_;
  RunOptions options_;
  Vector6d deviations_;
  Rig rig_ = pitched_pair();
  Pose body_from_rectified_;
  Trajectory truth_;
};

TEST_F(Consistency, ErrorsOfTheStatedCovarianceHaveSix) {
  write_run();
  const auto result = consistency({5, 1});
  ASSERT_TRUE(result.has_value()) << result.error().message();
  EXPECT_EQ(result->motions.count, kFrames - 1);
  EXPECT_NEAR(*result->motions.mean, 6, 0.4);
  EXPECT_NEAR(*result->motions.median, 5.35, 0.4);  // of a χ² distribution with 6 degrees of freedom
  ASSERT_EQ(result->segments.size(), 2U);
  EXPECT_EQ(result->segments[0].length_m, 1);
  EXPECT_NEAR(*result->segments[0].mean, 6, 1);
  EXPECT_EQ(result->segments[1].length_m, 5);
  EXPECT_NEAR(*result->segments[1].mean, 6, 2.5);
}

TEST_F(Consistency, LastingErrorsCountBySegments) {
  const Vector6d shared = Vector6d::Constant(0.5);
  write_run(shared);
  const double without = *consistency({5})->segments[0].mean;
  // 50 motions: a mean of 50 · 0.5 standard deviations against √50 of the noise.
  EXPECT_GT(without, 30);
  options_.localization.vision.constant_sigma_ratios = std::vector<double>(6, 0.5);
  folder_.write("config.yaml", dump_options(options_));
  const auto with = consistency({5});
  EXPECT_LT(*with->segments[0].mean, 9);
  EXPECT_NEAR(*with->motions.mean, 6 * 1.25, 0.6);  // their own covariances
}

TEST_F(Consistency, AMotionOverALostFrameCounts) {
  write_run(Vector6d::Zero(), 450);
  const auto result = consistency({1, 500});
  ASSERT_TRUE(result.has_value()) << result.error().message();
  EXPECT_EQ(result->motions.count, kFrames - 2);
  EXPECT_NEAR(*result->segments[0].mean, 6, 1);
  EXPECT_EQ(result->segments[1].count, 0);
  EXPECT_FALSE(result->segments[1].mean.has_value());
}

TEST_F(Consistency, SegmentsDoNotSpanFramesThatNoMotionSpans) {
  write_run();
  // Without the truth of every second frame there is no motion whose ends are known.
  Trajectory sparse;
  for (std::size_t i = 0; i < truth_.size(); i += 2) sparse.push_back(truth_[i]);
  truth_ = sparse;
  const auto result = consistency({1});
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(result->motions.count, 0);
  EXPECT_EQ(result->segments[0].count, 0);
}

TEST_F(Consistency, WhatIsMissingIsNamed) {
  write_run();
  std::filesystem::remove(folder_.file("rig.yaml"));
  EXPECT_NE(consistency({1}).error().message().find("rig.yaml"), std::string::npos);
  std::filesystem::remove(folder_.file("run.sqlite"));
  folder_.write("rig.yaml", to_rig_yaml(pitched_pair()));
  EXPECT_EQ(consistency({1}).error().code, ErrorCode::input);
}

}  // namespace
}  // namespace spartan
