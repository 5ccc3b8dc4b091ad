// Landmark management: updates the landmarks of t−1 with their measurements, re-anchors and removes them, adds new
// ones.
#pragma once

#include <vector>

#include "spartan/odometry/internal/landmark_matcher.h"
#include "spartan/odometry/internal/landmark_reconstructor.h"
#include "spartan/odometry/internal/landmarks/landmark.h"
#include "spartan/odometry/internal/motion_estimator.h"
#include "spartan/odometry/odometer.h"

namespace spartan::internal {

/// Marks a landmark: update() removes it, unless it is an inlier.
void discard(Landmark& landmark);

/// Makes the current frame the latest one: latest_from_anchor ← previous_from_current⁻¹ · latest_from_anchor.
void move_anchors(LandmarkMemory& memory, const Pose& previous_from_current);

class LandmarkManager {
 public:
  explicit LandmarkManager(const OdometryOptions& options) : options_(options) {}

  /// Applies the inliers' measurements to their landmarks (scalar Kalman update of the anchor's disparity), re-anchors
  /// landmarks whose apparent size has changed too much, and removes those without an inlier measurement in several
  /// consecutive frames. A landmark on which a feature lies (`feature_of`, −1: none; may be empty) takes over its
  /// descriptor. `establishes`: whether to follow this motion shows that a landmark is of the scene; not while the
  /// rover is stationary, when its own shadow does so, too. Matches need the left image. Call move_anchors() first.
  void update(LandmarkMemory& memory, const StereoImages& images, const std::vector<LandmarkMatch>& matches,
              const MotionFit& fit, bool establishes, const std::vector<ReconstructedFeature>& features,
              const std::vector<int>& feature_of) const;

  /// Adds features that are far enough from all landmarks and have a disparity as new landmarks, up to the maximum
  /// number of landmarks, anchored in the current frame.
  void add(LandmarkMemory& memory, const StereoImages& images, const std::vector<ReconstructedFeature>& features) const;

 private:
  OdometryOptions options_;
};

}  // namespace spartan::internal
