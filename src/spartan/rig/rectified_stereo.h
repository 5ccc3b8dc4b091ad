// Geometry of a rectified stereo pair.
#pragma once

#include <Eigen/Core>

#include "spartan/core/image.h"

namespace spartan {

/// Two equal pinholes with common rows, the right one `baseline_m` along +x of the left one. A point (x, y, z) of the
/// left optical frame projects to
///   u = f x/z + cx, v = f y/z + cy, d = u_left − u_right = f b / z.
struct RectifiedStereo {
  ImageSize size;
  double focal_px = 0;
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double baseline_m = 0;

  /// Point in the left optical frame, metres, of (u, v, d) in pixels with d > 0.
  Eigen::Vector3d triangulate(double u, double v, double d) const {
    const double z = focal_px * baseline_m / d;
    return {(u - centre_px.x()) * z / focal_px, (v - centre_px.y()) * z / focal_px, z};
  }
  /// (u, v, d) in pixels of a point with z > 0.
  Eigen::Vector3d project(const Eigen::Vector3d& p) const {
    const double scale = focal_px / p.z();
    return {scale * p.x() + centre_px.x(), scale * p.y() + centre_px.y(), scale * baseline_m};
  }
  /// ∂(u, v, d)/∂(x, y, z).
  Eigen::Matrix3d projection_jacobian(const Eigen::Vector3d& p) const {
    const double s = focal_px / p.z(), t = s / p.z();
    Eigen::Matrix3d j;
    j << s, 0, -t * p.x(), 0, s, -t * p.y(), 0, 0, -t * baseline_m;
    return j;
  }
  friend bool operator==(const RectifiedStereo&, const RectifiedStereo&) = default;
};

}  // namespace spartan
