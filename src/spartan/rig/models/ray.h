// Results of camera models: the ray of a pixel, and the pixel of a point with its Jacobian.
#pragma once

#include <Eigen/Core>

namespace spartan {

/// A viewing ray in the camera frame (x right, y down, z forward): origin in m, unit direction. The origin is zero for
/// central models.
struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
};

/// A pixel with its Jacobian by the point, ∂(u, v)/∂(x, y, z), in px/m.
struct ProjectionWithJacobian {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> by_point;
};

}  // namespace spartan
