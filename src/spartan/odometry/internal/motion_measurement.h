// Measures the motion from a frame with landmarks to the current images. Changes neither.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spartan/odometry/internal/coarse_motion.h"
#include "spartan/odometry/internal/landmark_matcher.h"
#include "spartan/odometry/internal/landmark_reconstructor.h"
#include "spartan/odometry/internal/motion_estimator.h"
#include "spartan/odometry/internal/motion_prediction.h"
#include "spartan/odometry/odometer.h"

namespace spartan::internal {

struct MotionMeasurement {
  TrackingStatus status = TrackingStatus::lost;  ///< `stationary`: the motion is the identity
  std::string reason;                            ///< why the status is not `tracking`
  UncertainPose previous_from_current;
  int matches = 0;
  MotionFit fit;           ///< of the matches that are kept; only of a motion that was measured
  bool is_new = false;     ///< most landmarks that agree are new, and their motion was not predicted
  bool untrusted = false;  ///< lost although a motion was found: it is rather that of an object
  bool ambiguous = false;  ///< measured, but it may be that of an object
  OdometryTimes times;

  // For the update of the landmarks.
  std::vector<LandmarkMatch> kept;
  std::vector<std::size_t> on_object;          ///< indices of the landmarks that follow an object
  std::vector<ReconstructedFeature> features;  ///< as in CoarseMotion
  std::vector<int> feature_of;

  bool is_lost() const { return status == TrackingStatus::lost; }
};

class MotionMeasurer {
 public:
  /// Keeps references to all but the options.
  MotionMeasurer(const OdometryOptions& options, LandmarkDetector& detector, LandmarkMatcher& matcher,
                 const MotionEstimator& estimator, const ThreadPool& workers)
      : options_(options),
        matcher_(matcher),
        estimator_(estimator),
        coarse_(options, detector, matcher, estimator, workers) {}

  /// `pyramid`: of the image of that side. `trusts_new`: whether a motion of new landmarks that was not predicted is
  /// measured, not lost, although established landmarks do not follow it.
  MotionMeasurement measure(const LandmarkFrame& previous, const StereoImages& images, const ImagePyramid& pyramid,
                            ImageSide side, const MotionPrediction& prediction, bool trusts_new);

 private:
  bool may_be_by_chance(const RectifiedStereo& stereo, const LandmarkMemory& map, const MotionFit& fit,
                        const MotionPrediction& prediction) const;
  bool contradicts_established(const RectifiedStereo& stereo, const LandmarkMemory& map,
                               const std::vector<LandmarkMatch>& matches, const MotionFit& fit) const;
  void decide_status(const RectifiedStereo& stereo, const std::string& doubt, MotionMeasurement& measured) const;

  OdometryOptions options_;
  LandmarkMatcher& matcher_;
  const MotionEstimator& estimator_;
  CoarseMotionEstimator coarse_;
};

}  // namespace spartan::internal
