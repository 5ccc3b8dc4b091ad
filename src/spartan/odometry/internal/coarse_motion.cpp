#include "spartan/odometry/internal/coarse_motion.h"

#include <cmath>
#include <utility>

namespace spartan::internal {
namespace {

/// With fewer inliers the coarse motion is replaced by the prediction; empirical.
constexpr int kMinCoarseInliers = 10;
/// With fewer inliers inside of the gates, the descriptors are matched over the whole image as well; empirical.
constexpr int kSufficientCoarseInliers = 30;
/// Standard deviation of a position by the change of viewpoint, as a fraction of the parallax since the anchor. Scatter
/// of the residuals at the true poses of the scenario traverse_100m: 0.10 px at a parallax of 10 px, 0.15 px at 60 px.
constexpr double kViewpointNoise = 0.002;
/// The motion of the scene has at least this fraction of the inliers that an object has; empirical.
constexpr double kMinSceneFraction = 0.5;

}  // namespace

struct CoarseMotionEstimator::Attempt {
  std::vector<LandmarkMatch> matches;
  std::optional<MotionFit> fit;
  std::vector<ReconstructedFeature> features;
  std::vector<int> feature_of;
  int inliers() const { return fit ? fit->inliers : 0; }
  bool is_sufficient() const {
    return inliers() >= kSufficientCoarseInliers && 2 * inliers() >= static_cast<int>(matches.size());
  }
};

CoarseMotionEstimator::CoarseMotionEstimator(const OdometryOptions& options, LandmarkDetector& detector,
                                             LandmarkMatcher& matcher, const MotionEstimator& estimator,
                                             ThreadPool workers)
    : options_(options),
      detector_(detector),
      reconstructor_(options.reconstruction),
      matcher_(matcher),
      estimator_(estimator),
      workers_(std::move(workers)) {}

CoarseMotionEstimator::Attempt CoarseMotionEstimator::by_pyramid(const LandmarkFrame& reference,
                                                                 const StereoImages& images,
                                                                 const ImagePyramid& pyramid, ImageSide side,
                                                                 const MotionPrediction& prediction) {
  std::vector<Pose> starts{prediction.motion};
  starts.insert(starts.end(), prediction.other_starts.begin(), prediction.other_starts.end());
  Attempt best;
  for (const Pose& start : starts) {
    Attempt found;
    found.matches = matcher_.by_pyramid(reference.map, images, reference.pyramid, pyramid, start.inverse(), side);
    found.fit = estimator_.coarse(images.geometry, found.matches, 0, start);
    if (found.inliers() > best.inliers()) best = std::move(found);
    if (best.is_sufficient()) break;
  }
  return best;
}

/// Inside of the gates around the predicted positions, then over the whole image.
CoarseMotionEstimator::Attempt CoarseMotionEstimator::by_descriptor(const LandmarkMemory& landmarks,
                                                                    const StereoImages& images, const Pose& predicted) {
  Attempt best;
  std::vector<ReconstructedFeature> features =
      reconstructor_.reconstruct(images, detector_.detect(images.left, images.left_mask), workers_);
  for (const std::optional<Pose>& current_from_previous : {std::optional(predicted.inverse()), std::optional<Pose>()}) {
    Attempt found;
    found.feature_of = matcher_.by_descriptor(landmarks, features, images.geometry, current_from_previous);
    found.matches = matcher_.coarse_matches(landmarks, features, found.feature_of);
    found.fit = estimator_.coarse(images.geometry, found.matches, 0, predicted);
    if (best.feature_of.empty() || found.inliers() > best.inliers()) best = std::move(found);
    if (best.inliers() >= kSufficientCoarseInliers) break;
  }
  best.features = std::move(features);
  return best;
}

CoarseMotion CoarseMotionEstimator::estimate(const LandmarkFrame& reference, const StereoImages& images,
                                             const ImagePyramid& pyramid, ImageSide side,
                                             const MotionPrediction& prediction) {
  CoarseMotion result;
  result.previous_from_current = prediction.motion;
  if (!options_.matching.descriptors) return result;
  Attempt best;
  if (options_.matching.correlation) best = by_pyramid(reference, images, pyramid, side, prediction);
  if (!best.is_sufficient() && side == ImageSide::left) {
    Attempt described = by_descriptor(reference.map, images, prediction.motion);
    if (described.inliers() > best.inliers()) {
      best = std::move(described);
    } else {
      best.features = std::move(described.features);
    }
  }
  if (best.inliers() >= kMinCoarseInliers && prediction.from_measured_motion) {
    if (std::optional<ChosenMotion> chosen = other_motion(reference, images, pyramid, side, best, prediction)) {
      best.fit = std::move(chosen->fit);
      result.doubt = std::move(chosen->reason);
      result.object = chosen->object;
    }
  }
  if (best.inliers() >= kMinCoarseInliers) result.previous_from_current = best.fit->previous_from_current;
  result.matches = std::move(best.matches);
  result.features = std::move(best.features);
  result.feature_of = std::move(best.feature_of);
  return result;
}

/// Where the largest set of matches may be that of an object.
std::optional<ChosenMotion> CoarseMotionEstimator::other_motion(const LandmarkFrame& reference,
                                                                const StereoImages& images, const ImagePyramid& pyramid,
                                                                ImageSide side, const Attempt& largest,
                                                                const MotionPrediction& prediction) {
  const RectifiedStereo& stereo = images.geometry;
  if (options_.matching.correlation && is_of_young_landmarks(largest.matches, *largest.fit)) {
    const Pose by_prediction = prediction.motion.inverse();
    const auto scene_of = [&](const std::vector<LandmarkMatch>& established) {
      return find_established_motion(estimator_, stereo, established, largest.matches, *largest.fit, prediction.motion);
    };
    // Patches of the pyramid are large, so an object beside a landmark disturbs it there; it needs a better prediction
    // without.
    auto near =
        scene_of(matcher_.by_correlation(reference.map, images, by_prediction, side, WhichLandmarks::established));
    auto far = scene_of(matcher_.by_pyramid(reference.map, images, reference.pyramid, pyramid, by_prediction, side,
                                            WhichLandmarks::established));
    if (near && (!far || near->fit.inliers >= far->fit.inliers)) return near;
    if (far) return far;
  }
  const auto rival = find_rival(estimator_, stereo, largest.matches, *largest.fit, prediction.motion);
  if (!rival) return std::nullopt;
  ChosenMotion chosen = choose_motion(largest.matches, *largest.fit, *rival);
  const bool is_false = chosen.object && is_false_rival(reference.map, images, side, prediction.offset,
                                                        chosen.fit.previous_from_current, *chosen.object);
  return is_false ? std::nullopt : std::optional(std::move(chosen));
}

/// Whether a rival consists of wrong matches: then far fewer landmarks have their patches where it predicts them than
/// where the largest set does.
bool CoarseMotionEstimator::is_false_rival(const LandmarkMemory& landmarks, const StereoImages& images, ImageSide side,
                                           const DisparityOffset& offset, const Pose& rival, const Pose& largest) {
  if (!options_.matching.correlation) return false;
  const auto inliers = [&](const Pose& motion) {
    std::vector<LandmarkMatch> matches = matcher_.by_correlation(landmarks, images, motion.inverse(), side);
    if (options_.matching.rigidity) matches = keep_rigid(images.geometry, std::move(matches));
    add_noise_floor(options_.motion, images.geometry, motion, matches);
    const auto fit = estimator_.fine(images.geometry, matches, motion, offset);
    return fit ? fit->inliers : 0;
  };
  return inliers(rival) < kMinSceneFraction * inliers(largest);
}

void add_noise_floor(const MotionEstimationOptions& options, const RectifiedStereo& stereo,
                     const Pose& previous_from_current, std::vector<LandmarkMatch>& matches) {
  const double pixel = options.pixel_sigma_px, disparity = options.disparity_sigma_px;
  const Pose current_from_previous = previous_from_current.inverse();
  for (LandmarkMatch& match : matches) {
    const Pose current_from_anchor = current_from_previous * match.previous_from_anchor;
    const auto here = project_anchored(stereo, match.point, current_from_anchor);
    const auto at_infinity = project_anchored(stereo, {match.point.pixel, 0}, current_from_anchor);
    if (here && at_infinity) match.parallax_px = (here->measured - at_infinity->measured).head<2>().norm();
    const double variance = pixel * pixel + std::pow(kViewpointNoise * match.parallax_px, 2);
    match.covariance.diagonal() += Eigen::Vector3d(variance, variance, disparity * disparity);
  }
}

}  // namespace spartan::internal
