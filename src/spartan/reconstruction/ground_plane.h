// The ground plane in front of a stereo pair, estimated from the gradients of its disparity image.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

/// Points p of the left optical frame with up · p = −height_m. Their disparities are linear in the image coordinates,
///   d = g · (u − c) + d_c  with  g = −(b/h) (up_x, up_y),  d_c = −(f b/h) up_z.
struct GroundPlane {
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();  ///< Unit normal that points away from the ground.
  double height_m = 1;                             ///< Height of the left camera above the plane.

  double disparity(const RectifiedStereo& g, double u, double v) const {
    const double x = (u - g.centre_px.x()) / g.focal_px, y = (v - g.centre_px.y()) / g.focal_px;
    return -g.focal_px * g.baseline_m / height_m * (up.x() * x + up.y() * y + up.z());
  }
  /// Angle of the optical axis below the plane's horizon, rad.
  double pitch_rad() const;
  /// Rotation of the image about the optical axis, rad; positive where the right side of the image is lower.
  double roll_rad() const;
};

struct GroundPlaneOptions {
  int block_px = 16;                ///< Side of an image block whose disparity gradient is fitted, pixels.
  double disparity_sigma_px = 0.3;  ///< Standard deviation of a disparity, pixels.
  double max_tilt_deg = 35;         ///< Largest angle between a block's plane and the expected plane, degrees.

  template <class Visitor>
  void describe(Visitor& v) {
    v.field(
        "block_px", block_px,
        "Side of the square image blocks to which planes are fitted, in pixels; raising it makes the gradients less "
        "noisy, but fewer blocks lie on the ground alone.",
        between(4, 128));
    v.field("disparity_sigma_px", disparity_sigma_px,
            "Standard deviation of a disparity in pixels; blocks whose residuals are larger than three of it are "
            "discarded as not planar, and the gates on obstacles and cavities follow from it.",
            between(0.01, 5));
    v.renamed("steepest_deg", "max_tilt_deg");
    v.field("max_tilt_deg", max_tilt_deg,
            "Largest angle between the plane of a block and the expected ground plane, in degrees; blocks that are "
            "tilted more have no vote, so raise it for rough ground or an uncertain attitude.",
            between(1, 80));
  }
};

/// Estimates the ground plane, which is the ground correlation line of the v-disparity image (Labayrade, Aubert &
/// Tarel, IV 2002), without a Hough transform: a plane is fitted to each block of the disparity image; all blocks of
/// one plane in space have the same gradient, and the ground is the plane on which most blocks agree in gradient, then
/// in height. `expected` bounds the search; it is the plane that the rig and its attitude predict, and its height gives
/// the scale only. Returns nothing where fewer than a twentieth of the blocks agree.
std::optional<GroundPlane> find_ground_plane(ImageView<const float> disparity, const RectifiedStereo& geometry,
                                             const GroundPlane& expected, const GroundPlaneOptions& options);

}  // namespace spartan
