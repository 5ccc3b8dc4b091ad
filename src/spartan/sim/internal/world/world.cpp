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

World make_world(const Scenario& scenario, const Drive& drive) {
  const auto seed = static_cast<std::uint64_t>(scenario.seed);
  const ChassisOptions& chassis = scenario.chassis;
  const std::vector<PlanarPose> track = drive.track();
  World world{TerrainShape(scenario.terrain, seed),
              RockField(scenario.rocks, seed),
              {},
              Soil(scenario.soil, seed),
              Sun(scenario.light),
              scenario.light.sky_lux};
  constexpr double kSideMargin_m = 0.1;  // of the corridor beside the wheels' middle lines
  world.rocks.clear_corridor(DriveCorridor(track, 0.5 * chassis.track_m + kSideMargin_m), chassis.clearance_m);
  const double reach = std::hypot(chassis.wheelbase_m, chassis.track_m);
  world.wheel_lift = WheelLift(world.rocks.rocks_in(bounds_of(track).grown(reach), WheelLift::kPressedIn_m),
                               chassis.wheel_radius_m, chassis.wheel_width_m);
  world.shape.set_datum(fit_to_ground({world.shape, world.wheel_lift}, chassis, drive.at(0))[2]);
  return world;
}

}  // namespace spartan::sim::internal
