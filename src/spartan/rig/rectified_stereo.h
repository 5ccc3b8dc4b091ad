// Geometry of a rectified stereo pair, and the axes in which the rows of both cameras agree.
#pragma once

#include <Eigen/Core>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"

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

/// Rotations from the rectified frame into the optical frames of the left and the right camera.
struct RectifyingAxes {
  Eigen::Matrix3d left_from_rectified = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d right_from_rectified = Eigen::Matrix3d::Identity();
};

/// x along the baseline; z the mean of the two optical axes, orthogonalized to x; y = z × x. After Fusiello, Trucco,
/// Verri, "A compact algorithm for rectification of stereo pairs", 2000, with the mean optical axis instead of the left
/// one, so that both cameras are rotated equally. The baseline must not be zero or parallel to the mean axis.
inline RectifyingAxes rectifying_axes(const Pose& right_from_left) {
  const Pose left_from_right = right_from_left.inverse();
  const Eigen::Vector3d x = left_from_right.translation().normalized();
  const Eigen::Vector3d mean_axis = Eigen::Vector3d::UnitZ() + left_from_right.rotation() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d z = (mean_axis - mean_axis.dot(x) * x).normalized();
  RectifyingAxes axes;
  axes.left_from_rectified << x, z.cross(x), z;
  axes.right_from_rectified = right_from_left.rotation_matrix() * axes.left_from_rectified;
  return axes;
}

}  // namespace spartan
