// Keeping the landmarks of t−1: what was measured goes in, what is gone goes out, new ones come.
#pragma once

#include <vector>

#include "spartan/odometry/landmark.h"
#include "spartan/odometry/landmark_matching.h"
#include "spartan/odometry/landmark_reconstruction.h"
#include "spartan/odometry/motion_estimation.h"
#include "spartan/odometry/odometry_options.h"

namespace spartan {

/// The latest shot is now the current one.
void move_anchors(LandmarkMemory& memory, const Pose& previous_from_current);

class LandmarkUpkeep {
 public:
  explicit LandmarkUpkeep(const OdometryOptions& options) : options_(options) {}

  /// Takes the inliers' measurements into their landmarks (a Kalman update of the anchor's disparity), gives those that
  /// have grown or shrunk too much a new patch, drops those that were missed too often. One that a feature stands on
  /// (`feature_of`, −1: none; may be empty) takes over its descriptor, as its look has changed. The anchors have been
  /// moved.
  void update(LandmarkMemory& memory, const StereoImages& images, const std::vector<LandmarkMatch>& matches,
              const MotionFit& fit, const std::vector<ReconstructedFeature>& features,
              const std::vector<int>& feature_of) const;

  /// Features that stand apart from all landmarks become landmarks, up to the number asked for; the current shot
  /// becomes their anchor.
  void add(LandmarkMemory& memory, const StereoImages& images, const std::vector<ReconstructedFeature>& features) const;

 private:
  OdometryOptions options_;
};

}  // namespace spartan
