#include "spartan/sim/internal/drive/drive_corridor.h"

#include <cmath>

namespace spartan::sim::internal {

DriveCorridor::DriveCorridor(const std::vector<PlanarPose>& track, double half_width_m, double left_m)
    : half_width_m_(half_width_m) {
  for (const PlanarPose& p : track) {
    const PlanarPose beside{p.x - left_m * std::sin(p.heading), p.y + left_m * std::cos(p.heading), p.heading};
    track_.add(beside.x, beside.y, beside);
  }
}

bool DriveCorridor::intersects_disc(double x, double y, double radius_m) const {
  const double reach = half_width_m_ + radius_m;
  return track_.any_near(Region{x, y, x, y}.grown(reach),
                         [&](const PlanarPose& p) { return std::hypot(p.x - x, p.y - y) < reach; });
}

}  // namespace spartan::sim::internal
