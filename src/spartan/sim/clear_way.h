// The strip of ground that the rover's wheels and belly need.
#pragma once

#include <vector>

#include "spartan/sim/path.h"
#include "spartan/sim/spatial_hash.h"

namespace spartan::sim {

class ClearWay {
 public:
  ClearWay() = default;
  /// Everything within `half_width_m` of the track.
  ClearWay(const std::vector<PlanarPose>& track, double half_width_m);

  /// Whether a disc reaches into the strip.
  bool blocked_by(double x, double y, double radius_m) const;

 private:
  double half_width_m_ = 0;
  SpatialHash<PlanarPose> track_;
};

}  // namespace spartan::sim
