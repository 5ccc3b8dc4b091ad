// The strip of ground along the path that the rover's wheels and belly need.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "spartan/sim/internal/world/spatial_hash.h"
#include "spartan/sim/scenario.h"

namespace spartan::sim::internal {

/// The points within a distance of the track, or of the path of another point of the rover.
class DriveCorridor {
 public:
  /// An empty corridor.
  DriveCorridor() = default;
  /// `follows_m`: the point that the corridor follows, ahead and to the left of the middle of the rover.
  DriveCorridor(const std::vector<PlanarPose>& track, double half_width_m,
                const Eigen::Vector2d& follows_m = Eigen::Vector2d::Zero());

  /// Whether a disc overlaps the corridor.
  bool intersects_disc(double x, double y, double radius_m) const;

 private:
  double half_width_m_ = 0;
  SpatialHash<PlanarPose> track_;
};

}  // namespace spartan::sim::internal
