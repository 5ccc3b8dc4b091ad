// The motion to a few pixels, from some landmarks that are found near their predicted positions, else from descriptors.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/core/threads.h"
#include "spartan/odometry/internal/detection/landmark_detector.h"
#include "spartan/odometry/internal/landmark_matcher.h"
#include "spartan/odometry/internal/landmark_reconstructor.h"
#include "spartan/odometry/internal/landmarks/landmark.h"
#include "spartan/odometry/internal/matching/image_pyramid.h"
#include "spartan/odometry/internal/motion_estimator.h"
#include "spartan/odometry/internal/motion_prediction.h"
#include "spartan/odometry/internal/rival_motion.h"

namespace spartan::internal {

struct CoarseMotion {
  Pose previous_from_current;  ///< the prediction where too few landmarks agree
  std::vector<LandmarkMatch> matches;
  std::vector<ReconstructedFeature> features;  ///< of the whole image; empty where no descriptors were matched
  std::vector<int> feature_of;                 ///< index of the feature of each landmark, −1: none; may be empty
  std::string doubt;                           ///< why this may be the motion of an object; empty otherwise
  std::optional<Pose> object;                  ///< its motion, where it is known
};

class CoarseMotionEstimator {
 public:
  /// Keeps references to all but the options.
  CoarseMotionEstimator(const OdometryOptions& options, LandmarkDetector& detector, LandmarkMatcher& matcher,
                        const MotionEstimator& estimator, ThreadPool workers);

  /// From the landmarks of the reference frame and the current images, with the pyramid of the side in which landmarks
  /// are located first. Descriptors are matched in left images only.
  CoarseMotion estimate(const LandmarkFrame& reference, const StereoImages& images, const ImagePyramid& pyramid,
                        ImageSide side, const MotionPrediction& prediction);

 private:
  struct Attempt;
  Attempt by_pyramid(const LandmarkFrame& reference, const StereoImages& images, const ImagePyramid& pyramid,
                     ImageSide side, const MotionPrediction& prediction);
  Attempt by_descriptor(const LandmarkMemory& landmarks, const StereoImages& images, const Pose& predicted);
  std::optional<ChosenMotion> other_motion(const LandmarkFrame& reference, const StereoImages& images,
                                           const ImagePyramid& pyramid, ImageSide side, const Attempt& largest,
                                           const MotionPrediction& prediction);
  bool is_false_rival(const LandmarkMemory& landmarks, const StereoImages& images, ImageSide side,
                      const DisparityOffset& offset, const Pose& rival, const Pose& largest);
  OdometryOptions options_;
  LandmarkDetector& detector_;
  LandmarkReconstructor reconstructor_;
  LandmarkMatcher& matcher_;
  const MotionEstimator& estimator_;
  ThreadPool workers_;
};

/// Adds the noise that the residual of a single patch alignment does not show: the specified one, and one that grows
/// with the change of viewpoint since the anchor, by which shadows and the sides of stones come into view.
void add_noise_floor(const MotionEstimationOptions& options, const RectifiedStereo& stereo,
                     const Pose& previous_from_current, std::vector<LandmarkMatch>& matches);

}  // namespace spartan::internal
