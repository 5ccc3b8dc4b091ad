#include "spartan/sim/internal/drive/wheel_lift.h"

#include <gtest/gtest.h>

#include <cmath>

#include "spartan/sim/internal/drive/body_motion.h"

namespace spartan::sim::internal {
namespace {

Rock dome(double x, double y, double radius_m) {
  Rock rock;
  rock.x = x;
  rock.y = y;
  rock.diameter_m = 2 * radius_m;
  rock.height_m = radius_m;
  return rock;
}

// Two touching circles: the wheel's centre is at a distance R + a from that of the dome, at height √((R + a)² − d²).
TEST(WheelLift, MatchesACircleOnACircle) {
  constexpr double kWheel_m = 0.1, kDome_m = 0.04;
  const WheelLift lift({dome(1, 2, kDome_m)}, kWheel_m, 0.01);
  const double heading = 0.7, reach = std::sqrt(std::pow(kWheel_m + kDome_m, 2) - kWheel_m * kWheel_m);
  for (double d = -0.12; d <= 0.12; d += 0.007) {
    const double expected = std::abs(d) < reach ? std::sqrt(std::pow(kWheel_m + kDome_m, 2) - d * d) - kWheel_m : 0.0;
    EXPECT_NEAR(lift.at(1 + d * std::cos(heading), 2 + d * std::sin(heading), heading), expected, 0.0015) << d;
  }
}

TEST(WheelLift, IgnoresPebblesAndRocksBesideTheWheel) {
  const WheelLift lift({dome(0, 0, 0.009), dome(0, 1, 0.04)}, 0.1, 0.08);
  EXPECT_EQ(lift.at(0, 0, 0), 0);
  EXPECT_EQ(lift.at(0, 1 - 0.085, 0), 0);
  EXPECT_GT(lift.at(0, 1 - 0.075, 0), 0);
  EXPECT_GT(lift.at(0, 1 - 0.085, 1.5), 0);
}

TEST(WheelLift, AnElongatedRockLiftsAlongItsLength) {
  Rock rock = dome(0, 0, 0.04);
  rock.elongation = 1.6;
  rock.turn_rad = 1.5707963;
  const WheelLift lift({rock}, 0.1, 0.01);
  EXPECT_GT(lift.at(0, 0.048, 0), 0);
  EXPECT_GT(lift.at(0.034, 0, 1.5707963), 0);
  EXPECT_EQ(lift.at(0.04, 0, 1.5707963), 0);
}

// A rock under the left front wheel: the body rises by a quarter of its height and tilts away from it.
TEST(WheelLift, TheBodyTiltsAwayFromTheRock) {
  TerrainShapeOptions level;
  level.relief_m = level.ripple_height_m = level.dune_height_m = 0;
  const TerrainShape shape(level, 1);
  const ChassisOptions chassis;
  const PlanarPose at{2, -1, 0.6};
  const double c = std::cos(at.heading), s = std::sin(at.heading), along = 0.5 * chassis.wheelbase_m,
               aside = 0.5 * chassis.track_m;
  const WheelLift lift({dome(at.x + c * along - s * aside, at.y + s * along + c * aside, 0.04)}, chassis.wheel_radius_m,
                       0.01);
  const Vector6d flat = fit_to_ground({shape, WheelLift()}, chassis, at),
                 tilted = fit_to_ground({shape, lift}, chassis, at);
  EXPECT_NEAR(tilted[2] - flat[2], 0.01, 1e-9);
  EXPECT_NEAR(tilted[4] - flat[4], -std::atan(0.02 / chassis.wheelbase_m), 1e-4);
  EXPECT_NEAR(tilted[3] - flat[3], std::atan(0.02 / chassis.track_m), 1e-4);
}

}  // namespace
}  // namespace spartan::sim::internal
