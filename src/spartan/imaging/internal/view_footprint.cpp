#include "spartan/imaging/internal/view_footprint.h"

#include <algorithm>

namespace spartan::internal {
namespace {

constexpr int kFootprintBlock = 8;  // px

bool is_in_view(const Camera& camera, const RectifiedStereo& view, const Eigen::Matrix3d& camera_from_rectified,
                double depth_m, const Eigen::Vector2d& pixel) {
  const auto ray = unproject(camera.model, pixel);
  if (!ray) return false;
  const Eigen::Vector3d origin = camera_from_rectified.transpose() * ray->origin;
  const Eigen::Vector3d direction = camera_from_rectified.transpose() * ray->direction;
  if (!(direction.z() > 0)) return false;
  const Eigen::Vector3d pixel_in_view = view.project(origin + (depth_m - origin.z()) / direction.z() * direction);
  return pixel_in_view.x() > -0.5 && pixel_in_view.y() > -0.5 && pixel_in_view.x() < view.size.width - 0.5 &&
         pixel_in_view.y() < view.size.height - 0.5;
}

}  // namespace

Image<std::uint8_t> view_footprint(const Camera& camera, const RectifiedStereo& view,
                                   const Eigen::Matrix3d& camera_from_rectified, double depth_m) {
  Image<std::uint8_t> footprint(camera.size);
  for (int top = 0; top < camera.size.height; top += kFootprintBlock) {
    const int below = std::min(top + kFootprintBlock, camera.size.height);
    for (int left = 0; left < camera.size.width; left += kFootprintBlock) {
      const int right = std::min(left + kFootprintBlock, camera.size.width);
      const Eigen::Vector2d centre((left + right - 1) / 2.0, (top + below - 1) / 2.0);
      if (!is_in_view(camera, view, camera_from_rectified, depth_m, centre)) continue;
      for (int y = top; y < below; ++y) std::fill(footprint.row(y) + left, footprint.row(y) + right, std::uint8_t{255});
    }
  }
  return footprint;
}

}  // namespace spartan::internal
