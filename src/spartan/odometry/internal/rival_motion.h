// Two rigid motions among the matches: the static scene and an object that moves. Derivation: docs/math/odometry.md.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/odometry/internal/motion_estimator.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan::internal {

/// The motion of the camera against the static scene, where the matches contain two motions of comparable support.
struct ChosenMotion {
  MotionFit fit;
  std::string reason;  ///< names the two motions, and whether they could be told apart; for a status
};

/// A second motion among the outliers of `first`, with an inlier for each match. It is searched only where `first`
/// deviates from `predicted` (previous_from_current), which costs another RANSAC. A rival agrees with the prediction
/// better than `first`, has at least a twentieth of its inliers, and contradicts most of them. std::nullopt where there
/// is none.
std::optional<MotionFit> find_rival(const MotionEstimator& estimator, const RectifiedStereo& stereo,
                                    const std::vector<LandmarkMatch>& matches, const MotionFit& first,
                                    const Pose& predicted);

/// The rival, which is the predicted motion, unless its inliers are compact and those of `first` spread over the image:
/// then it may be an object that moves with the camera, and `first` is chosen.
ChosenMotion choose_motion(const std::vector<LandmarkMatch>& matches, const MotionFit& first, const MotionFit& rival);

}  // namespace spartan::internal
