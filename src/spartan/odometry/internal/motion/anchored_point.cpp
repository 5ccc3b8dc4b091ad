#include "spartan/odometry/internal/motion/anchored_point.h"

#include <Eigen/Dense>

namespace spartan::internal {
std::optional<AnchoredProjection> project_anchored(const RectifiedStereo& stereo, const AnchoredPoint& point,
                                                   const Pose& current_from_anchor) {
  const double f = stereo.focal_px, inverse_fb = 1 / (f * stereo.baseline_m);
  const Eigen::Matrix3d rotation = current_from_anchor.rotation_matrix();
  const Eigen::Vector3d& t = current_from_anchor.translation();
  const Eigen::Vector3d ray((point.pixel.x() - stereo.centre_px.x()) / f, (point.pixel.y() - stereo.centre_px.y()) / f,
                            1);
  const double w = point.disparity * inverse_fb;
  const Eigen::Vector3d q = rotation * ray + w * t;
  if (!(q.z() > kMinRelativeDepth)) return std::nullopt;

  const double g = 1 / q.z();
  AnchoredProjection p;
  p.measured = {f * g * q.x() + stereo.centre_px.x(), f * g * q.y() + stereo.centre_px.y(), point.disparity * g};
  Eigen::Matrix3d by_q;
  by_q << f * g, 0, -f * g * g * q.x(),  //
      0, f * g, -f * g * g * q.y(),      //
      0, 0, -point.disparity * g * g;
  p.by_motion.leftCols<3>() = -w * by_q;
  p.by_motion.rightCols<3>() = by_q * skew(q);
  p.by_disparity = by_q * t * inverse_fb + Eigen::Vector3d(0, 0, g);
  p.by_anchor_pixel = by_q * rotation.leftCols<2>() / f;
  return p;
}

AnchoredWarp warp_of(const AnchoredProjection& projection, const Eigen::Vector2d& slant) {
  const Eigen::Matrix<double, 3, 2> total = projection.by_anchor_pixel + projection.by_disparity * slant.transpose();
  AnchoredWarp warp;
  warp.pixels = total.topRows<2>();
  // d'(u, v) along the surface: ∂d'/∂(x, y) · ∂(x, y)/∂(u, v).
  warp.slant = warp.pixels.inverse().transpose() * total.row(2).transpose();
  return warp;
}

}  // namespace spartan::internal
