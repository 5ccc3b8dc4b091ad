// The common axes of a stereo pair in which the rows of both cameras agree.
#pragma once

#include <Eigen/Core>

#include "spartan/core/pose.h"

namespace spartan {

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
