// Projection of a point that is given by pixel and disparity in another frame (anchored inverse-depth
// parameterization). Source: Civera, Davison, Montiel, "Inverse depth parametrization for monocular SLAM", T-RO 24
// (2008); derivation in docs/math/odometry.md.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "spartan/core/pose.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan::internal {

/// Smallest depth relative to the depth in the anchor at which a point counts as in front of the camera; empirical.
inline constexpr double kMinRelativeDepth = 0.01;

/// Pixel and disparity of a point in the left image of its anchor frame.
struct AnchoredPoint {
  Eigen::Vector2d pixel;
  double disparity = 0;
};

struct AnchoredProjection {
  Eigen::Vector3d measured;                     ///< predicted (u, v, d) in the other frame, pixels
  Eigen::Matrix<double, 3, 6> by_motion;        ///< Jacobian by ξ of previous_from_current · Exp(ξ)
  Eigen::Vector3d by_disparity;                 ///< Jacobian by the disparity in the anchor
  Eigen::Matrix<double, 3, 2> by_anchor_pixel;  ///< Jacobian by the pixel in the anchor
};

/// With x̄ = (x/z, y/z, 1) the ray of the pixel and w = d/(f b) the inverse depth, the point divided by its depth in the
/// anchor is, in the other frame,
///   q = R x̄ + w t,   u = f q_x/q_z + c_x,  v = f q_y/q_z + c_y,  d' = d/q_z.
/// This is linear in the disparity and regular at infinity, so the noise of distant points neither biases the estimate
/// nor diverges. A right perturbation ξ = (ρ, φ) of previous_from_current gives δq = −w ρ + q × φ.
/// std::nullopt where the point is not in front of the camera.
std::optional<AnchoredProjection> project_anchored(const RectifiedStereo& stereo, const AnchoredPoint& point,
                                                   const Pose& current_from_anchor);

/// Affine warp of the image around a point from the anchor to the other frame: ∂(u, v)/∂(x, y) for a surface whose
/// disparity gradient in the anchor is `slant` (pixels per pixel), and the disparity gradient in the other frame.
struct AnchoredWarp {
  Eigen::Matrix2d pixels;
  Eigen::Vector2d slant;
};
AnchoredWarp warp_of(const AnchoredProjection& projection, const Eigen::Vector2d& slant);

}  // namespace spartan::internal
