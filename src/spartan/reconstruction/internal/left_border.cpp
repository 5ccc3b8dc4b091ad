#include "spartan/reconstruction/internal/left_border.h"

#include <limits>

namespace spartan::internal {
namespace {

constexpr double kDepth = 0.25;  // below the plane, over the height of the camera: slopes and pits are less deep there

}  // namespace

void drop_matches_below_ground(const GroundPlane& plane, const RectifiedStereo& geometry, Image<float>& disparity) {
  for (int v = 0; v < disparity.height(); ++v) {
    for (int u = 0; u < disparity.width(); ++u) {
      const double of_plane = plane.disparity(geometry, u, v);
      // The height over the plane is h (1 − d₀ / d).
      if (u < of_plane && static_cast<double>(disparity(u, v)) * (1 + kDepth) < of_plane)
        disparity(u, v) = std::numeric_limits<float>::quiet_NaN();
    }
  }
}

}  // namespace spartan::internal
