#include "spartan/sim/internal/drive/drive_corridor.h"

#include <cmath>

namespace spartan::sim::internal {

DriveCorridor::DriveCorridor(const std::vector<PlanarPose>& track, double half_width_m,
                             const Eigen::Vector2d& follows_m)
    : half_width_m_(half_width_m) {
  for (const PlanarPose& p : track) {
    const double c = std::cos(p.heading), s = std::sin(p.heading);
    const PlanarPose at{p.x + c * follows_m.x() - s * follows_m.y(), p.y + s * follows_m.x() + c * follows_m.y(),
                        p.heading};
    track_.add(at.x, at.y, at);
  }
}

bool DriveCorridor::intersects_disc(double x, double y, double radius_m) const {
  const double reach = half_width_m_ + radius_m;
  return track_.any_near(Region{x, y, x, y}.grown(reach),
                         [&](const PlanarPose& p) { return std::hypot(p.x - x, p.y - y) < reach; });
}

}  // namespace spartan::sim::internal
