#include <gtest/gtest.h>

#include "spartan/localization/internal/drive_test.h"
#include "spartan/localization/localizer.h"

namespace spartan {

using namespace internal;

namespace {

TEST(VisionOnlyFilter, ComposesTheMotionsInTheGivenWorld) {
  const TestDrive drive;
  const Pose first(exp_so3({0.1, -0.2, 0.7}), {1, 2, 3});
  const LocalizationOptions options;  // with drift
  VisionOnlyFilter track = VisionOnlyFilter::create(options).value();
  track.start(test_stamp(2.5), first);
  UncertainPose composed{first, Matrix6d::Zero()};
  for (const Measurement& m : test_motions(drive, 62.5, 1, 5)) {
    const auto& motion = std::get<RelativeMotion>(m);
    EXPECT_TRUE(track.add(motion));
    composed = compose(composed, {motion.previous_from_current, motion.covariance});
  }
  const UncertainPose pose = track.world_from_body();
  EXPECT_LE(log_se3(pose.pose.inverse() * composed.pose).norm(), 1e-6);
  for (int i = 0; i < 6; ++i)
    EXPECT_GT(pose.covariance(i, i), 1.5 * composed.covariance(i, i)) << "drift grows faster: " << i;
  // Map constraints are in that world too.
  const Pose seen = pose.pose * Pose::from_translation({3e-4, -3e-4, 0});
  EXPECT_TRUE(track.add(PoseConstraint{test_stamp(62.5), seen, 1e12 * Matrix6d::Identity()}));
  EXPECT_LE(log_se3(track.world_from_body().pose.inverse() * seen).norm(), 1e-5);
  VisionOnlyFilter other = VisionOnlyFilter::create(options).value();
  ASSERT_TRUE(other.restore(track.save()));
  EXPECT_EQ(other.save(), track.save());
  EXPECT_EQ(other.world_from_body().pose.matrix(), track.world_from_body().pose.matrix());
  EXPECT_FALSE(other.restore({}));
}

// One frame is lost; the next motion begins at the frame before it.
TEST(VisionOnlyFilter, ALostMotionThatKeepsItsReferenceCostsNothing) {
  const TestDrive drive;
  const LocalizationOptions options;
  VisionOnlyFilter all = VisionOnlyFilter::create(options).value(), bridged = VisionOnlyFilter::create(options).value();
  for (VisionOnlyFilter* each : {&all, &bridged}) each->start(test_stamp(2.5), drive.at(2.5));
  const Matrix6d covariance = test_motion_covariance();
  for (int i = 0; i < 20; ++i) {
    const double from = 2.5 + i, to = from + 1;
    EXPECT_TRUE(all.add(drive.motion(from, to, covariance)));
    if (i == 10) {
      RelativeMotion lost = drive.motion(from, to, Matrix6d::Identity());
      lost.previous_from_current = lost.previous_from_current * Pose::from_translation({0.05, 0.02, 0});
      lost.measured = false;
      lost.keeps_reference = true;
      EXPECT_TRUE(bridged.add(lost));
    } else {
      EXPECT_TRUE(bridged.add(drive.motion(i == 11 ? from - 1 : from, to, covariance)));
    }
  }
  const UncertainPose pose = bridged.world_from_body();
  EXPECT_LT(log_se3(pose.pose.inverse() * drive.at(22.5)).norm(), 1e-4);
  EXPECT_LT(pose.covariance.trace(), 1.05 * all.world_from_body().covariance.trace());
}

}  // namespace
}  // namespace spartan
