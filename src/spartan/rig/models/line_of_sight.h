// What a camera model answers: a line of sight for a pixel, a pixel for a point.
#pragma once

#include <Eigen/Core>

namespace spartan {

/// A line of sight in the camera frame (x right, y down, z forward); `direction` has unit length.
/// Central models have origin zero.
struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
};

/// A pixel with its derivative by the point, ∂(u, v)/∂(x, y, z), in px/m.
struct ProjectionWithJacobian {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> by_point;
};

}  // namespace spartan
