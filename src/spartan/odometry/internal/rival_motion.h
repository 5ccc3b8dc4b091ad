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
  std::optional<Pose> object;  ///< previous_from_current of the object; std::nullopt where the choice is ambiguous
  std::string reason;          ///< names the two motions, and whether they could be told apart; for a status
};

/// A second motion among the outliers of `first`, with an inlier for each match. It is searched only where `first`
/// deviates from `predicted` (previous_from_current), which costs up to three more RANSACs. The inliers of a rival
/// agree with the prediction better than those of `first`, are at least a twentieth of them, and contradict most of
/// them. std::nullopt where there is none.
std::optional<MotionFit> find_rival(const MotionEstimator& estimator, const RectifiedStereo& stereo,
                                    const std::vector<LandmarkMatch>& matches, const MotionFit& first,
                                    const Pose& predicted);

/// Another motion that most of the established landmarks follow, of which `established` are the measurements near the
/// prediction, while the largest set of `matches`, that of `first`, consists of young ones: `first` is then the motion
/// of an object, because its landmarks did not follow the scene before. std::nullopt where there is none.
std::optional<ChosenMotion> find_established_motion(const MotionEstimator& estimator, const RectifiedStereo& stereo,
                                                    const std::vector<LandmarkMatch>& established,
                                                    const std::vector<LandmarkMatch>& matches, const MotionFit& first,
                                                    const Pose& predicted);
/// Whether most inliers of a motion are young.
bool is_of_young_landmarks(const std::vector<LandmarkMatch>& matches, const MotionFit& motion);
/// Whether a motion deviates so little from the prediction that it is that of the scene.
bool is_as_predicted(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches, const MotionFit& motion,
                     const Pose& predicted);

/// The rival, which is the predicted motion, unless its inliers are compact and those of `first` spread over the image:
/// then it may be an object that moves with the camera, and `first` is chosen.
ChosenMotion choose_motion(const std::vector<LandmarkMatch>& matches, const MotionFit& first, const MotionFit& rival);

/// Which matches the motion of an object explains better than that of the scene (both previous_from_current). Those
/// that both motions predict within a pixel belong to the scene.
std::vector<bool> follows_object(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                                 const Pose& scene, const Pose& object);

}  // namespace spartan::internal
