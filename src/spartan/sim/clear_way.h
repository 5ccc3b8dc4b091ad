// The strip of ground that the rover's wheels and belly need.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "spartan/sim/path.h"

namespace spartan::sim {

class ClearWay {
 public:
  ClearWay() = default;
  /// Everything within `half_width_m` of the track.
  ClearWay(const std::vector<PlanarPose>& track, double half_width_m);

  /// Whether a disc reaches into the strip.
  bool blocked_by(double x, double y, double radius_m) const;

 private:
  static constexpr double kCell_m = 0.5;

  double half_width_m_ = 0;
  std::unordered_map<std::uint64_t, std::vector<PlanarPose>> cells_;
};

}  // namespace spartan::sim
