// What the odometry remembers of a place in the world.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/odometry/landmark_detector.h"
#include "spartan/odometry/patch_alignment.h"

namespace spartan {

/// A past shot in which landmarks were first seen.
struct Anchor {
  std::uint32_t id = 0;
  Pose latest_from_anchor;  ///< of the left optical frames; "latest" is the last shot that was taken in
};

/// A point of the world, given by a whole pixel of its anchor's left image and its disparity there. The pixel is the
/// point's definition and thus exact; all uncertainty of place lies in the disparity.
struct Landmark {
  std::uint32_t anchor_id = 0;
  Eigen::Vector2d anchor_pixel = Eigen::Vector2d::Zero();
  double disparity = 0;                             ///< in the anchor, pixels
  double variance = 0;                              ///< of the disparity, pixels²
  Eigen::Vector2d slant = Eigen::Vector2d::Zero();  ///< ∂disparity/∂(x, y) of the surface around it
  ImagePatch patch{};                               ///< how it looked in the anchor's left image

  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< in the latest shot
  float scale = 0;                                  ///< of the feature when it was last described
  float angle = 0;
  std::int8_t sign = 0;
  Descriptor descriptor{};
  std::int32_t missed = 0;  ///< shots in a row in which it was not found where it should be
};

/// The landmarks of t−1: the published "1/z" block of the odometry.
struct LandmarkMemory {
  std::uint32_t next_anchor_id = 0;
  std::vector<Anchor> anchors;
  std::vector<Landmark> landmarks;

  /// The anchor must be there.
  const Anchor& anchor(std::uint32_t id) const;
  /// Drops the anchors that no landmark refers to.
  void drop_unused_anchors();
};

}  // namespace spartan
