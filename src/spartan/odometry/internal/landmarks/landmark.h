// Landmarks that the odometry tracks, and the frames in which they are anchored.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/core/time.h"
#include "spartan/odometry/internal/detection/landmark_detector.h"
#include "spartan/odometry/internal/matching/image_pyramid.h"
#include "spartan/odometry/internal/matching/patch_alignment.h"

namespace spartan::internal {

/// A past stereo frame in which landmarks were first observed.
struct Anchor {
  std::uint32_t id = 0;
  Pose latest_from_anchor;  ///< between left optical frames; "latest" is the last stereo frame that was processed
};

/// A 3D point, parameterized by a whole pixel of its anchor's left image and its disparity there. The pixel defines the
/// point and is therefore exact; all uncertainty of its position lies in the disparity.
struct Landmark {
  std::uint32_t anchor_id = 0;
  Eigen::Vector2d anchor_pixel = Eigen::Vector2d::Zero();
  double disparity = 0;                             ///< in the anchor, pixels
  double variance = 0;                              ///< of the disparity, pixels²
  Eigen::Vector2d slant = Eigen::Vector2d::Zero();  ///< disparity gradient ∂d/∂(x, y) of the surface around it
  ImagePatch patch{};                               ///< its surroundings in the anchor's left image

  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< position in the latest left image
  float scale = 0;                                  ///< of the feature from which the descriptor was taken last
  float angle = 0;
  std::int8_t sign = 0;
  Descriptor descriptor{};
  std::int32_t missed_frames = 0;    ///< consecutive frames without an inlier measurement
  std::int32_t measured_frames = 0;  ///< frames in which it was an inlier of the scene while the rover moved
};

/// Whether a landmark has followed the scene in a frame after its first one: one on an object that has just come into
/// view or begun to move has not.
inline bool is_established(const Landmark& landmark) {
  return landmark.measured_frames > 0;
}

/// The landmarks of t−1: the published "1/z" block of the odometry.
struct LandmarkMemory {
  std::uint32_t next_anchor_id = 0;
  std::vector<Anchor> anchors;
  std::vector<Landmark> landmarks;

  /// Throws std::logic_error where there is no such anchor.
  const Anchor& anchor(std::uint32_t id) const;
  /// Removes the anchors that no landmark refers to.
  void drop_unused_anchors();
};

/// A frame, its landmarks and the pyramid of its left image.
struct LandmarkFrame {
  Stamp stamp;
  LandmarkMemory map;
  ImagePyramid pyramid;

  LandmarkFrame clone() const { return {stamp, map, pyramid.clone()}; }
};

}  // namespace spartan::internal
