// Projection of a point that is given by pixel and disparity in another shot.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "spartan/core/pose.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

/// Pixel and disparity of a point in a shot's left image.
struct AnchoredPoint {
  Eigen::Vector2d pixel;
  double disparity = 0;
};

struct AnchoredProjection {
  Eigen::Vector3d measured;                     ///< (u, v, d) in the other shot
  Eigen::Matrix<double, 3, 6> by_motion;        ///< by ξ of previous_from_current · Exp(ξ)
  Eigen::Vector3d by_disparity;                 ///< by the disparity in the anchor
  Eigen::Matrix<double, 3, 2> by_anchor_pixel;  ///< by the pixel in the anchor
};

/// With x̄ the ray (x/z, y/z, 1) of the pixel and w = d/(f b) the inverse depth, the point seen from the other shot is
///   q = R x̄ + w t   (times the depth),   u = f q_x/q_z + c_x,  v = f q_y/q_z + c_y,  d' = d/q_z.
/// Linear in the disparity and regular for points at infinity, so noise of far points neither biases nor explodes.
/// A right perturbation ξ = (ρ, φ) of previous_from_current gives δq = −w ρ + q × φ.
/// Nothing where the point is not in front of the camera.
std::optional<AnchoredProjection> project_anchored(const RectifiedStereo& stereo, const AnchoredPoint& point,
                                                   const Pose& current_from_anchor);

/// How the surroundings of the point look in the other shot: ∂(u, v)/∂(x, y) for a surface whose disparity changes by
/// `slant` per pixel, and the slant there.
struct AnchoredWarp {
  Eigen::Matrix2d pixels;
  Eigen::Vector2d slant;
};
AnchoredWarp warp_of(const AnchoredProjection& projection, const Eigen::Vector2d& slant);

}  // namespace spartan
