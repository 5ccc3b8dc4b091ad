// Estimates at other times than that of the newest sample, and stamps that are wrong.
#include <gtest/gtest.h>

#include <algorithm>

#include "spartan/localization/internal/drive_test.h"

namespace spartan {
namespace {

using namespace internal;

TEST(LocalizerTime, EstimatesAtATimeOfTheBuffer) {
  const TestDrive drive;
  const auto all = in_order(test_samples(drive, 22.5, {}, 61), test_motions(drive, 22.5, 1, 61));
  std::vector<Measurement> until;
  std::copy_if(all.begin(), all.end(), std::back_inserter(until),
               [](const Measurement& m) { return stamp_of_measurement(m) <= test_stamp(19); });
  const Localizer localizer = driven(test_options(), all);
  const LocalizationEstimate then = driven(test_options(), until).estimate();
  ASSERT_EQ(then.stamp, test_stamp(19));
  const auto now = localizer.estimate_at(test_stamp(19));
  ASSERT_TRUE(now);
  EXPECT_EQ(now->stamp, then.stamp);
  EXPECT_EQ(now->world_from_body.pose.matrix(), then.world_from_body.pose.matrix());
  EXPECT_EQ(now->world_from_body.covariance, then.world_from_body.covariance);
  EXPECT_EQ(now->odom_from_body.pose.matrix(), then.odom_from_body.pose.matrix());
  EXPECT_EQ(now->health_of(LocalizationSensor::imu).used, then.health_of(LocalizationSensor::imu).used);

  const auto ahead = localizer.estimate_at(test_stamp(22.7));
  ASSERT_TRUE(ahead);
  EXPECT_LT((ahead->world_from_body.pose.translation() - drive.at(2.5).inverse() * drive.at(22.7).translation()).norm(),
            0.02);
  EXPECT_GT(ahead->world_from_body.covariance(0, 0), localizer.estimate().world_from_body.covariance(0, 0));
  EXPECT_FALSE(localizer.estimate_at(test_stamp(3))) << "before the buffer";
}

TEST(LocalizerTime, AFrameStampFarAheadIsUndone) {
  const auto all = in_order(test_samples(TestDrive(), 42.5, {}, 54), test_motions(TestDrive(), 42.5, 1, 54));
  Localizer localizer = Localizer::create(test_options()).value();
  for (const Measurement& m : all) {
    if (stamp_of_measurement(m) > test_stamp(2.5) && !localizer.started())
      localizer.start(test_stamp(2.5), Eigen::Vector3d::UnitX());
    EXPECT_TRUE(localizer.add(m));
    if (std::holds_alternative<RelativeMotion>(m) && stamp_of_measurement(m) > test_stamp(20) &&
        stamp_of_measurement(m) < test_stamp(22)) {
      EXPECT_TRUE(localizer.add(RelativeMotion{stamp_of_measurement(m), test_stamp(3620), {}, Matrix6d::Identity()}));
      const Localizer interrupted = [&] {
        Localizer copy = Localizer::create(test_options()).value();
        EXPECT_TRUE(copy.restore(localizer.save()));
        return copy;
      }();
      EXPECT_EQ(interrupted.estimate().stamp, test_stamp(3620));
      EXPECT_TRUE(localizer.restore(interrupted.save()));
    }
  }
  const LocalizationEstimate e = localizer.estimate(), expected = driven(test_options(), all).estimate();
  EXPECT_EQ(e.stamp, expected.stamp);
  EXPECT_EQ(e.world_from_body.pose.matrix(), expected.world_from_body.pose.matrix());
  EXPECT_EQ(e.world_from_body.covariance, expected.world_from_body.covariance);
  EXPECT_GT(e.health_of(LocalizationSensor::vision).refused.too_early, 0);
}

}  // namespace
}  // namespace spartan
