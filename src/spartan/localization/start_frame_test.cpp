#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "spartan/localization/internal/drive_test.h"
#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/localizer.h"

namespace spartan {

using namespace internal;

namespace {

std::vector<ImuSample> resting(const Eigen::Vector3d& force, double scatter, int count) {
  Random random(1);
  std::vector<ImuSample> samples;
  samples.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    samples.push_back({test_stamp(0.01 * i), normal3(random, 1e-3), force + normal3(random, scatter)});
  return samples;
}

TEST(StartFrame, AveragesStaticReadings) {
  const Eigen::Vector3d force(0.1, -0.2, 3.7);
  const auto rest = static_reading(resting(force, 0.01, 400), test_options());
  ASSERT_TRUE(rest.has_value());
  EXPECT_TRUE(rest->stationary);
  EXPECT_LE((rest->accel_m_s2 - force).norm(), 5 * 0.01 / 20);
  EXPECT_NEAR(rest->accel_sigma_m_s2, test_options().imu.accel_noise_m_s2_sqrt_hz / 2, 1e-5);
}

TEST(StartFrame, RefusesOtherUnitsMotionAndTooFewSamples) {
  EXPECT_FALSE(static_reading(resting({0, 0, 1}, 0.01, 400), test_options()));
  EXPECT_FALSE(static_reading(resting({0, 0, 3.71}, 0.5, 400), test_options()));
  EXPECT_FALSE(static_reading(resting({0, 0, 3.71}, 0.01, 9), test_options()));
  const auto shaken = static_reading(resting({0, 0, 3.71}, 0.1, 400), test_options());
  ASSERT_TRUE(shaken.has_value());
  EXPECT_FALSE(shaken->stationary);
  EXPECT_GT(shaken->accel_sigma_m_s2, 0.05);
  auto broken = resting({0, 0, 3.71}, 0.01, 400);
  broken[7].accel_m_s2.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(static_reading(broken, test_options())->accel_m_s2.allFinite());
}

TEST(StartFrame, HeadingIsTheConsensus) {
  const std::vector<CompassSample> readings{{{}, 3.13, 0.02}, {{}, -1.0, 0.02}, {{}, -3.14, 0.02}, {{}, 3.12, 0.02}};
  const auto heading = consensus_heading(readings, 1e-3);
  ASSERT_TRUE(heading.has_value());
  EXPECT_NEAR(std::remainder(heading->radians - (3.13 + 3.12 + 2 * std::numbers::pi - 3.14) / 3, 2 * std::numbers::pi),
              0, 1e-9);
  EXPECT_NEAR(heading->sigma_rad, 0.02 / std::sqrt(3.0), 1e-9);
  EXPECT_FALSE(consensus_heading(std::vector<CompassSample>{{{}, 1, 0.02}, {{}, 2, 0.02}}, 1e-3));
  EXPECT_FALSE(consensus_heading({}, 1e-3));
  EXPECT_NEAR(consensus_heading(std::vector<CompassSample>{{{}, 1, 0.02}}, 1e-3)->radians, 1, 1e-12);
}

TEST(StartFrame, TiltIsTheMedian) {
  const auto tilt = median_tilt(
      std::vector<InclinometerSample>{{{}, 0.1, -0.1, 0.01}, {{}, 3, 2, 0.01}, {{}, 0.12, -0.12, 0.01}}, 1e-3);
  ASSERT_TRUE(tilt.has_value());
  EXPECT_EQ(tilt->roll_rad, 0.12);
  EXPECT_EQ(tilt->pitch_rad, -0.1);
  EXPECT_FALSE(median_tilt({}, 1e-3));
}

TEST(StartFrame, FirstPoseIsLevelWithTheGivenHeading) {
  const Eigen::Vector3d up = Eigen::Vector3d(0.1, -0.2, 1).normalized(), ahead(1, 0.3, -0.8);
  const Pose pose = first_pose(up, ahead, 0.4);
  EXPECT_LE((pose.rotation() * up - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  const Eigen::Vector3d looks = pose.rotation() * ahead;
  EXPECT_NEAR(std::atan2(looks.y(), looks.x()), 0.4, 1e-12);
  // A camera that looks straight down: body x replaces its axis.
  EXPECT_NEAR(heading_of(first_pose(Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitZ(), 0)), 0, 1e-12);
}

}  // namespace
}  // namespace spartan
