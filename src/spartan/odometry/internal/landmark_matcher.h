// Landmark matching, a sub-module of the published odometry: associates the landmarks of t−1 with the current frame.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "spartan/core/threads.h"
#include "spartan/odometry/internal/landmark_reconstructor.h"
#include "spartan/odometry/internal/landmarks/landmark.h"
#include "spartan/odometry/internal/matching/image_pyramid.h"
#include "spartan/odometry/internal/motion_estimator.h"

namespace spartan::internal {

/// The image of the current pair in which landmarks are located first.
enum class ImageSide : std::uint8_t { left, right };

/// Established landmarks were inliers before.
enum class WhichLandmarks : std::uint8_t { all, established };

class LandmarkMatcher {
 public:
  LandmarkMatcher(const LandmarkMatchingOptions& options, const LandmarkReconstructor& reconstruction,
                  ThreadPool workers)
      : options_(options), reconstruction_(reconstruction), workers_(std::move(workers)) {}

  /// For each landmark the index of the feature that matches it, or −1. Features are candidates within the gate around
  /// the position that `current_from_previous` predicts (without it: in the whole image); the best one must pass the
  /// maximum descriptor distance and the ratio test (Lowe, IJCV 60, 2004, §7.1). Each feature matches at most one
  /// landmark.
  std::vector<int> by_descriptor(const LandmarkMemory& memory, const std::vector<ReconstructedFeature>& features,
                                 const RectifiedStereo& stereo, const std::optional<Pose>& current_from_previous) const;

  /// Pairs of landmark and feature as measurements for the coarse motion.
  std::vector<LandmarkMatch> coarse_matches(const LandmarkMemory& memory,
                                            const std::vector<ReconstructedFeature>& features,
                                            const std::vector<int>& feature_of) const;

  /// Measures some 200 landmarks, spread over the list, whose predicted positions may be off by 30 px: each is found in
  /// the pyramids of the latest left image and the current image of that side, then measured as by_correlation() does.
  std::vector<LandmarkMatch> by_pyramid(const LandmarkMemory& memory, const StereoImages& images,
                                        const ImagePyramid& latest, const ImagePyramid& current,
                                        const Pose& current_from_previous, ImageSide side = ImageSide::left,
                                        WhichLandmarks which = WhichLandmarks::all);

  /// Measures each landmark: its patch, warped by the predicted geometry, is aligned with the image of that side, and,
  /// from the left image, its disparity is searched near the predicted one; where that fails the landmark is measured
  /// in the left image alone. `current_from_previous` must be accurate to a few pixels.
  std::vector<LandmarkMatch> by_correlation(const LandmarkMemory& memory, const StereoImages& images,
                                            const Pose& current_from_previous, ImageSide side = ImageSide::left,
                                            WhichLandmarks which = WhichLandmarks::all);

 private:
  /// `start_px`: where the landmark is, to a few pixels; without it where the motion predicts it.
  std::optional<LandmarkMatch> correlate(const LandmarkMemory& memory, std::size_t index, const StereoImages& images,
                                         const Pose& current_from_previous, ImageSide side,
                                         const std::optional<Eigen::Vector2d>& start_px = {}) const;
  std::vector<LandmarkMatch> collect(std::size_t count,
                                     const std::function<std::optional<LandmarkMatch>(std::size_t)>& measure);
  LandmarkMatchingOptions options_;
  LandmarkReconstructor reconstruction_;
  ThreadPool workers_;
  std::vector<std::optional<LandmarkMatch>> found_;  // of each landmark; kept, so that its memory is
};

/// Rigidity check: discards matches whose 3D distances to most of their partners have changed by more than the noise
/// explains, since a rigid scene preserves all distances between its points. Each match is compared with about
/// `partners` others, spread over the list. Fewer than eight matches are returned unchanged.
std::vector<LandmarkMatch> keep_rigid(const RectifiedStereo& stereo, std::vector<LandmarkMatch> matches,
                                      int partners = 24);

}  // namespace spartan::internal
