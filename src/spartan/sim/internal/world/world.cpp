#include "spartan/sim/internal/world/world.h"

#include <algorithm>
#include <cmath>

#include "spartan/sim/internal/drive/body_motion.h"

namespace spartan::sim::internal {

Region bounds_of(const std::vector<PlanarPose>& track) {
  Region region{track.front().x, track.front().y, track.front().x, track.front().y};
  for (const PlanarPose& p : track)
    region = {std::min(region.x0, p.x), std::min(region.y0, p.y), std::max(region.x1, p.x), std::max(region.y1, p.y)};
  return region;
}

namespace {

// Removes the rocks that the rover cannot drive over.
void clear_way(RockField& rocks, const ChassisOptions& chassis, const std::vector<PlanarPose>& track) {
  constexpr double kMargin_m = 0.1;  // beside the wheels' middle lines
  if (chassis.corridor == CorridorKind::full) {
    rocks.clear_corridor(DriveCorridor(track, 0.5 * chassis.track_m + kMargin_m), chassis.clearance_m);
    return;
  }
  for (const double left_m : {0.5 * chassis.track_m, -0.5 * chassis.track_m})
    rocks.clear_corridor(DriveCorridor(track, kMargin_m, left_m), chassis.clearance_m);
  rocks.clear_corridor(DriveCorridor(track, 0.5 * chassis.track_m), chassis.body_clearance_m);
}

}  // namespace

World make_world(const Scenario& scenario, const Drive& drive) {
  const auto seed = static_cast<std::uint64_t>(scenario.seed);
  const ChassisOptions& chassis = scenario.chassis;
  const std::vector<PlanarPose> track = drive.track();
  const GroundCover cover(scenario.cover, seed);
  World world{TerrainShape(scenario.terrain, seed, cover),
              RockField(scenario.rocks, seed),
              {},
              Soil(scenario.soil, seed, cover),
              Sun(scenario.light),
              scenario.light.sky_lux};
  clear_way(world.rocks, chassis, track);
  world.rocks.bury_under_dust(cover);
  const double reach = std::hypot(chassis.wheelbase_m, chassis.track_m);
  world.wheel_lift = WheelLift(world.rocks.rocks_in(bounds_of(track).grown(reach), WheelLift::kPressedIn_m),
                               chassis.wheel_radius_m, chassis.wheel_width_m);
  world.shape.set_datum(fit_to_ground({world.shape, world.wheel_lift}, chassis, drive.at(0))[2]);
  return world;
}

}  // namespace spartan::sim::internal
