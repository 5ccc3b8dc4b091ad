// Landmark matching: the published sub-module. Finds the landmarks of t−1 again in the current shot.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "spartan/core/threads.h"
#include "spartan/odometry/landmark.h"
#include "spartan/odometry/landmark_reconstruction.h"
#include "spartan/odometry/motion_estimation.h"

namespace spartan {

/// A feature of the current shot together with its disparity, where that was found. Features stand on whole pixels.
struct ReconstructedFeature {
  Feature feature;
  std::optional<RowAlignment> stereo;
};

class LandmarkMatching {
 public:
  LandmarkMatching(const LandmarkMatchingOptions& options, const LandmarkReconstruction& reconstruction,
                   Workers workers)
      : options_(options), reconstruction_(reconstruction), workers_(std::move(workers)) {}

  /// For each landmark the index of the feature that is like it, or −1: within the gate around the place that
  /// `current_from_previous` predicts (without it: anywhere), near in descriptor, clearly nearer than the second one,
  /// and each feature for one landmark only.
  std::vector<int> by_descriptor(const LandmarkMemory& memory, const std::vector<ReconstructedFeature>& features,
                                 const RectifiedStereo& stereo, const std::optional<Pose>& current_from_previous) const;

  /// Pairs of landmark and feature, as coarse matches for a first motion.
  std::vector<LandmarkMatch> coarse_matches(const LandmarkMemory& memory,
                                            const std::vector<ReconstructedFeature>& features,
                                            const std::vector<int>& feature_of) const;

  /// Re-establishes each landmark by correlating its patch, warped by the predicted geometry, and measures its
  /// disparity by a narrow search. `current_from_previous` is good to a few pixels.
  std::vector<LandmarkMatch> by_correlation(const LandmarkMemory& memory, const StereoImages& images,
                                            const Pose& current_from_previous) const;

 private:
  std::optional<LandmarkMatch> correlate(const LandmarkMemory& memory, std::size_t index, const StereoImages& images,
                                         const Pose& current_from_previous) const;
  LandmarkMatchingOptions options_;
  LandmarkReconstruction reconstruction_;
  Workers workers_;
};

/// Drops matches whose distances to most of their partners have changed beyond what the noise explains: a rigid world
/// keeps all distances between its points. Each match is compared with `partners` others, spread over the list.
std::vector<LandmarkMatch> keep_rigid(const RectifiedStereo& stereo, std::vector<LandmarkMatch> matches,
                                      int partners = 24);

}  // namespace spartan
