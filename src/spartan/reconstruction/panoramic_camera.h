// The virtual camera into which the views of one rover position are merged.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

/// Looks around its z axis from one point: azimuth φ = atan2(y, x) falls from left to right by equal steps. Rows are
/// equal steps of z/√(x² + y²) on a cylinder, or of elevation on a sphere.
class PanoramicCamera {
 public:
  enum class Projection { cylinder, sphere };

  PanoramicCamera() = default;
  /// `left_rad` and `top` (slope or elevation) are those of the middle of the first column and row; `per_radian`
  /// columns a radian, rows a unit of slope or a radian.
  PanoramicCamera(Projection projection, ImageSize size, double per_radian, double left_rad, double top);

  ImageSize size() const { return size_; }
  double per_radian() const { return per_radian_; }
  /// Pixel of a direction (not zero) in this camera's axes: x forward, y left, z up. None straight up or down on a
  /// cylinder; it may lie outside the image.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& direction) const;
  /// Unit vector through a pixel.
  Eigen::Vector3d direction(double u, double v) const;

 private:
  Projection projection_ = Projection::cylinder;
  ImageSize size_;
  double per_radian_ = 1, left_rad_ = 0, top_ = 0;
};

/// Where a pair stands at one shot of a position.
struct ViewGeometry {
  RectifiedStereo stereo;
  Pose body_from_left;  ///< rectified left optical frame
};

/// A panoramic camera at `body_from_centre` just large enough for everything that the views see between `nearest_m` and
/// `farthest_m` before the eye.
PanoramicCamera plan_panorama(PanoramicCamera::Projection projection, double per_radian, const Pose& body_from_centre,
                              std::span<const ViewGeometry> views, double nearest_m, double farthest_m);

}  // namespace spartan
