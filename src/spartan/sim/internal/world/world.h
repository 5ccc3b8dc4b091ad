// The simulated world of a scenario.
#pragma once

#include <vector>

#include "spartan/sim/internal/camera/light.h"
#include "spartan/sim/internal/drive/wheel_lift.h"
#include "spartan/sim/internal/world/region.h"
#include "spartan/sim/internal/world/rock_field.h"
#include "spartan/sim/internal/world/soil.h"
#include "spartan/sim/internal/world/terrain_shape.h"
#include "spartan/sim/scenario.h"

namespace spartan::sim::internal {

struct World {
  TerrainShape shape;
  RockField rocks;
  WheelLift wheel_lift;
  Soil soil;
  Sun sun;
  double sky_lux = 0;
};

/// The world that a scenario describes, shifted vertically so that the body starts at height 0, with no rocks above
/// the clearance on the path.
World make_world(const Scenario& scenario, const Drive& drive);

/// Bounding rectangle of a track.
Region bounds_of(const std::vector<PlanarPose>& track);

}  // namespace spartan::sim::internal
