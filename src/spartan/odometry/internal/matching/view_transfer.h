// Errors of corresponding points of two images under a known geometry.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "spartan/odometry/view_matching.h"

namespace spartan::internal {

/// A point moved by a homography; none where it goes to infinity or comes from behind the image plane.
std::optional<Eigen::Vector2d> transferred(const Eigen::Matrix3d& homography, const Eigen::Vector2d& point);

/// Measures how far points are from where the geometry has them.
class ViewTransfer {
 public:
  explicit ViewTransfer(const ImageRelation& geometry);
  /// The larger one of the distances in both images, pixels: from the corresponding point, or from its epipolar line.
  /// Infinite where there is none.
  double error(const Eigen::Vector2d& first, const Eigen::Vector2d& second) const;

 private:
  ImageRelation geometry_;
  Eigen::Matrix3d back_;  ///< from the second image to the first one
};

}  // namespace spartan::internal
