// The common axes of two eyes, in which their rows are the same.
#pragma once

#include <Eigen/Core>

#include "spartan/core/pose.h"

namespace spartan {

/// A direction of the rectified view is `left_from_rectified` times it in the axes of the left camera; the same for the
/// right one.
struct RectifyingAxes {
  Eigen::Matrix3d left_from_rectified = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d right_from_rectified = Eigen::Matrix3d::Identity();
};

/// x along the baseline; z the mean of the two optical axes made orthogonal to it; y = z × x (after Fusiello, Trucco,
/// Verri, "A compact algorithm for rectification of stereo pairs", 2000, with the mean axis in the place of the old
/// left one, so that both eyes turn equally). The baseline must neither vanish nor lie along the mean axis.
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
