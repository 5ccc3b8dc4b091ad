// The virtual panoramic camera into which the views of one stop are merged.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/pose.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

/// A camera with one projection centre and a field of view around its z axis. Azimuth φ = atan2(y, x) decreases by
/// equal steps from left to right. Rows are equal steps of slope z/√(x² + y²) on a cylinder, or of elevation angle on a
/// sphere.
class PanoramicCamera {
 public:
  enum class Projection { cylinder, sphere };
  friend constexpr auto enum_names(Projection) {
    return std::array{EnumName{Projection::cylinder, "cylinder"}, EnumName{Projection::sphere, "sphere"}};
  }

  PanoramicCamera() = default;
  /// `left_rad` and `top` (slope or elevation) are those of the centres of the first column and row; `per_radian` is
  /// the number of columns per radian, and of rows per unit of slope or per radian.
  PanoramicCamera(Projection projection, ImageSize size, double per_radian, double left_rad, double top);

  ImageSize size() const { return size_; }
  double per_radian() const { return per_radian_; }
  /// Pixel of a direction (not zero) in this camera's axes: x forward, y left, z up. It may lie outside of the image.
  /// None for directions straight up or down.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& direction) const;
  /// Unit vector through a pixel.
  Eigen::Vector3d direction(double u, double v) const;

 private:
  Projection projection_ = Projection::cylinder;
  ImageSize size_;
  double per_radian_ = 1, left_rad_ = 0, top_ = 0;
};

/// Geometry and pose of a stereo pair for one view of a stop.
struct ViewGeometry {
  RectifiedStereo stereo;
  Pose body_from_left;  ///< Rectified left optical frame.
};

/// The smallest panoramic camera at `body_from_centre` that contains everything the views see at depths between
/// `nearest_m` and `farthest_m` from their cameras.
PanoramicCamera plan_panorama(PanoramicCamera::Projection projection, double per_radian, const Pose& body_from_centre,
                              std::span<const ViewGeometry> views, double nearest_m, double farthest_m);

}  // namespace spartan
