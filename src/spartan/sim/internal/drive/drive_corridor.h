// The strip of ground along the path that the rover's wheels and belly need.
#pragma once

#include <vector>

#include "spartan/sim/internal/world/spatial_hash.h"
#include "spartan/sim/scenario.h"

namespace spartan::sim::internal {

/// The points within a distance of the track, or of a line beside it.
class DriveCorridor {
 public:
  /// An empty corridor.
  DriveCorridor() = default;
  /// `left_m`: of the corridor's middle from the track; negative to the right.
  DriveCorridor(const std::vector<PlanarPose>& track, double half_width_m, double left_m = 0);

  /// Whether a disc overlaps the corridor.
  bool intersects_disc(double x, double y, double radius_m) const;

 private:
  double half_width_m_ = 0;
  SpatialHash<PlanarPose> track_;
};

}  // namespace spartan::sim::internal
