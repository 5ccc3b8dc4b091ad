#include "spartan/sim/internal/camera/light.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "spartan/core/pose.h"

namespace spartan::sim::internal {
namespace {}  // namespace

Sun::Sun(const LightOptions& options) : lux_(options.sun_lux) {
  const double elevation = options.sun_elevation_deg * kRadiansPerDegree;
  const double azimuth = options.sun_azimuth_deg * kRadiansPerDegree;
  const Eigen::Vector3d middle(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                               std::sin(elevation));
  const Eigen::Vector3d aside(-std::sin(azimuth), std::cos(azimuth), 0), over = middle.cross(aside);
  // The corners of the square with the second moments of the disc.
  const double off = 0.5 * std::tan(0.5 * options.sun_diameter_deg * kRadiansPerDegree);
  for (int i = 0; i < kPoints; ++i) {
    const double u = i % 2 == 0 ? -off : off, v = i / 2 == 0 ? -off : off;
    points_[static_cast<std::size_t>(i)] = (middle + u * aside + v * over).normalized().cast<float>();
  }
}

double Sun::horizontal_lux(double sky_lux) const {
  double up = 0;
  for (const Eigen::Vector3f& point : points_) up += static_cast<double>(point.z()) / kPoints;
  return sky_lux + lux_ * std::max(up, 0.0);
}

}  // namespace spartan::sim::internal
