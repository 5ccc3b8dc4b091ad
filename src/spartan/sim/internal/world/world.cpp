#include "spartan/sim/internal/world/world.h"

#include <algorithm>
#include <cmath>

#include "spartan/sim/internal/drive/body_motion.h"
#include "spartan/sim/internal/drive/driven_poses.h"

namespace spartan::sim::internal {

Region bounds_of(const std::vector<PlanarPose>& track) {
  Region region{track.front().x, track.front().y, track.front().x, track.front().y};
  for (const PlanarPose& p : track)
    region = {std::min(region.x0, p.x), std::min(region.y0, p.y), std::max(region.x1, p.x), std::max(region.y1, p.y)};
  return region;
}

namespace {

// Removes the rocks that the rover cannot drive over.
void clear_way(RockField& rocks, const ChassisOptions& chassis, const Drive& drive) {
  const std::vector<PlanarPose> track = drive.track();
  constexpr double kMargin_m = 0.1;  // beside the wheels' middle lines
  if (chassis.corridor == CorridorKind::full) {
    rocks.clear_corridor(DriveCorridor(track, 0.5 * chassis.track_m + kMargin_m), chassis.clearance_m);
    return;
  }
  // The track has one pose of a turn in place, in which the wheels drive on a circle.
  constexpr double kStep_m = 0.02;
  std::vector<PlanarPose> poses;
  for (const DrivenPose& driven :
       driven_poses([&](double time_s) { return drive.at(time_s); }, drive.seconds(), chassis, kStep_m))
    poses.push_back(driven.pose);
  for (const double left_m : {0.5 * chassis.track_m, -0.5 * chassis.track_m}) {
    for (const double ahead_m : {0.5 * chassis.wheelbase_m, -0.5 * chassis.wheelbase_m})
      rocks.clear_corridor(DriveCorridor(poses, kMargin_m, {ahead_m, left_m}), chassis.clearance_m);
  }
  rocks.clear_corridor(DriveCorridor(track, 0.5 * chassis.track_m), chassis.body_clearance_m);
}

}  // namespace

World make_world(const Scenario& scenario, const Drive& drive) {
  const auto seed = static_cast<std::uint64_t>(scenario.seed);
  const ChassisOptions& chassis = scenario.chassis;
  const GroundCover cover(scenario.cover, seed);
  World world{TerrainShape(scenario.terrain, seed, cover),
              RockField(scenario.rocks, seed),
              {},
              Soil(scenario.soil, seed, cover),
              Sun(scenario.light),
              scenario.light.sky_lux};
  clear_way(world.rocks, chassis, drive);
  world.rocks.bury_under_dust(cover);
  const double reach = std::hypot(chassis.wheelbase_m, chassis.track_m);
  world.wheel_lift = WheelLift(world.rocks.rocks_in(bounds_of(drive.track()).grown(reach), WheelLift::kPressedIn_m),
                               chassis.wheel_radius_m, chassis.wheel_width_m);
  world.shape.set_datum(fit_to_ground({world.shape, world.wheel_lift}, chassis, drive.at(0))[2]);
  return world;
}

}  // namespace spartan::sim::internal
