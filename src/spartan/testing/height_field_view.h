// True disparities of a height field by ray marching.
#pragma once

#include <functional>
#include <limits>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan::testing {

/// The disparity image of z = height(x, y), which has no overhangs; NaN where a ray hits nothing within 30 m. Marches
/// in steps of 1 cm and bisects the last one.
inline Image<float> disparity_of(const std::function<double(double, double)>& height, const RectifiedStereo& g,
                                 const Pose& world_from_left) {
  constexpr double kStep_m = 0.01, kFarthest_m = 30;
  Image<float> disparity(g.size.width, g.size.height, std::numeric_limits<float>::quiet_NaN());
  const Eigen::Vector3d& centre = world_from_left.translation();
  for (int v = 0; v < g.size.height; ++v) {
    for (int u = 0; u < g.size.width; ++u) {
      const Eigen::Vector3d ray((u - g.centre_px.x()) / g.focal_px, (v - g.centre_px.y()) / g.focal_px, 1);
      const Eigen::Vector3d along = world_from_left.rotation() * ray;
      const auto over = [&](double depth) {
        const Eigen::Vector3d p = centre + depth * along;
        return p.z() - height(p.x(), p.y());
      };
      for (double depth = kStep_m; depth < kFarthest_m; depth += kStep_m) {
        if (over(depth) > 0) continue;
        double free = depth - kStep_m, met = depth;
        for (int i = 0; i < 30; ++i) {
          const double middle = 0.5 * (free + met);
          (over(middle) > 0 ? free : met) = middle;
        }
        disparity(u, v) = static_cast<float>(g.focal_px * g.baseline_m / met);
        break;
      }
    }
  }
  return disparity;
}

/// body_from_left of a camera `height_m` above the body's origin, panned to the left and tilted down.
inline Pose camera_pose_at(double height_m, double pan_rad, double tilt_rad, const Pose& optical_from_forward) {
  const Eigen::Quaterniond rotation =
      Eigen::AngleAxisd(pan_rad, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d::UnitY());
  return Pose(rotation, {0, 0, height_m}) * optical_from_forward.inverse();
}

}  // namespace spartan::testing
