// The plane that the ground before a pair lies around, from the orientation of disparities.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

/// Points p of the left optical frame with up · p = −height_m. Their disparities are linear in the image,
///   d = g · (u − c) + d_c  with  g = −(b/h) (up_x, up_y),  d_c = −(f b/h) up_z.
struct GroundPlane {
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();  ///< unit normal away from the ground
  double height_m = 1;                             ///< of the left eye over it

  double disparity(const RectifiedStereo& g, double u, double v) const {
    const double x = (u - g.centre_px.x()) / g.focal_px, y = (v - g.centre_px.y()) / g.focal_px;
    return -g.focal_px * g.baseline_m / height_m * (up.x() * x + up.y() * y + up.z());
  }
  /// Of the optical axis below the plane's horizon, rad.
  double pitch_rad() const;
  /// Of the image about the optical axis: positive where the right side is lower.
  double roll_rad() const;
};

struct GroundPlaneOptions {
  int block_px = 16;
  double disparity_sigma_px = 0.3;
  double steepest_deg = 35;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("block_px", block_px, "side of the patches whose orientation is taken", between(4, 128));
    v.field("disparity_sigma_px", disparity_sigma_px, "standard deviation of a disparity", between(0.01, 5));
    v.field("steepest_deg", steepest_deg, "patches turned more against the expected ground do not vote",
            between(1, 80));
  }
};

/// The v-disparity line without a Hough transform: each patch of the disparity image has an orientation, its gradient,
/// which is the same all over a plane; the ground is where most patches agree in gradient, then in height. `expected`
/// (a plane through whatever is known of the rig and its attitude; its height counts only as a scale) bounds the
/// search. None where fewer than a twentieth of the patches agree.
std::optional<GroundPlane> find_ground_plane(ImageView<const float> disparity, const RectifiedStereo& geometry,
                                             const GroundPlane& expected, const GroundPlaneOptions& options);

}  // namespace spartan
