#include "spartan/sim/internal/drive/driven_poses.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "spartan/sim/internal/world/world.h"

namespace spartan::sim::internal {
namespace {

std::vector<DrivenPose> poses_of(const PathOptions& path, double step_m) {
  const auto drive = Drive::plan(path, {}, Rig());
  return driven_poses([&](double time_s) { return drive->at(time_s); }, drive->seconds(), {}, step_m);
}

TEST(DrivenPoses, AreOneStepApartWhateverTheSpeed) {
  for (const double speed_m_s : {0.05, 2.0}) {
    const auto poses = poses_of({.kind = PathKind::straight, .length_m = 2, .speed_m_s = speed_m_s}, 0.01);
    ASSERT_NEAR(static_cast<double>(poses.size()), 201, 1) << speed_m_s;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      EXPECT_NEAR(poses[i].pose.x, 0.01 * static_cast<double>(i), 1e-6);
      EXPECT_NEAR(poses[i].driven_m, 0.01 * static_cast<double>(i), 1e-9);
      EXPECT_GE(poses[i].time_s, i > 0 ? poses[i - 1].time_s : 0);
    }
  }
}

TEST(DrivenPoses, InATurnInPlaceTheWheelsMoveOnTheirCircle) {
  const ChassisOptions chassis;
  const double radius_m = 0.5 * std::hypot(chassis.wheelbase_m, chassis.track_m);
  const auto poses = poses_of({.kind = PathKind::turn_in_place, .turn_deg = 90}, 0.01);
  EXPECT_NEAR(poses.back().driven_m, std::numbers::pi / 2 * radius_m, 0.011);
  EXPECT_NEAR(poses.back().pose.heading, std::numbers::pi / 2, 0.011 / radius_m);
}

TEST(World, WheelsHaveNoHighRocksInTheirWayWhereTheyTurnInPlace) {
  Scenario scenario;
  scenario.path = {.kind = PathKind::turn_in_place, .turn_deg = 360};
  scenario.rocks = {.coverage = 0.25, .pebbles_per_m2 = 0};
  scenario.chassis.corridor = CorridorKind::wheels;
  const double radius_m = 0.5 * std::hypot(scenario.chassis.wheelbase_m, scenario.chassis.track_m);
  int lower = 0;
  for (scenario.seed = 1; scenario.seed <= 20; ++scenario.seed) {
    const World world = make_world(scenario, Drive::plan(scenario.path, {}, Rig()).value());
    for (const Rock& rock : world.rocks.rocks_in({-1, -1, 1, 1})) {
      if (std::abs(std::hypot(rock.x, rock.y) - radius_m) > 0.05 + 0.5 * rock.diameter_m) continue;
      EXPECT_LE(rock.height_m, scenario.chassis.clearance_m) << "seed " << scenario.seed;
      lower += rock.height_m > 0.5 * scenario.chassis.clearance_m ? 1 : 0;
    }
  }
  EXPECT_GT(lower, 5) << "lower ones stay";
}

}  // namespace
}  // namespace spartan::sim::internal
