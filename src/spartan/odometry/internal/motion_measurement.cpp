#include "spartan/odometry/internal/motion_measurement.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "spartan/core/stage_clock.h"

namespace spartan::internal {
namespace {

/// Wrong matches, uniformly distributed over the search radius r, have an rms of r/2 in each coordinate; a fit to few
/// of them lowers it. Empirical.
constexpr double kChanceRadiusFraction = 0.25;
/// Wrong matches are not more than this fraction of the landmarks; empirical.
constexpr double kChanceFraction = 0.1;
/// χ² of 99.9 % with 6 degrees of freedom, times 2²: at rest standard deviations are too small by up to 2, because the
/// noise of the anchor's patch is the same in all frames (Odometer.IsStationaryOnImagesThatDifferInNoiseOnly; 73 at
/// most on rover_sandbox).
constexpr double kMaxRest = 4 * 22.46;
/// Of the established landmarks that are in view, at least this fraction follows the motion of the scene; empirical.
constexpr double kMinAgreeingFraction = 0.25;
/// A motion that this fraction of all landmarks follows is not that of an object; empirical.
constexpr double kMinUndisputedFraction = 0.4;

/// Mean image flow in pixels that a motion causes at the inlier landmarks.
double mean_flow(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches, const MotionFit& fit) {
  const Pose current_from_previous = fit.previous_from_current.inverse();
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!fit.inlier[i]) continue;
    const auto previous = project_anchored(stereo, matches[i].point, matches[i].previous_from_anchor);
    const auto current =
        project_anchored(stereo, matches[i].point, current_from_previous * matches[i].previous_from_anchor);
    if (!previous || !current) continue;
    sum += (current->measured - previous->measured).head<2>().norm();
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

/// Whether the covariance of a motion leaves it open whether the rover has moved: χ² test, 6 degrees of freedom.
bool agrees_with_rest(const MotionFit& fit) {
  const Vector6d motion = log_se3(fit.previous_from_current);
  return motion.dot(fit.covariance.ldlt().solve(motion)) <= kMaxRest;
}

/// Number of landmarks that a motion predicts inside of the left image.
int count_in_view(const RectifiedStereo& stereo, const LandmarkMemory& map, const Pose& previous_from_current,
                  WhichLandmarks which) {
  const Pose current_from_previous = previous_from_current.inverse();
  int count = 0;
  for (const Landmark& landmark : map.landmarks) {
    if (which == WhichLandmarks::established && !is_established(landmark)) continue;
    const auto p = project_anchored(stereo, {landmark.anchor_pixel, landmark.disparity},
                                    current_from_previous * map.anchor(landmark.anchor_id).latest_from_anchor);
    count += p && p->measured.x() > 0 && p->measured.x() < stereo.size.width && p->measured.y() > 0 &&
             p->measured.y() < stereo.size.height;
  }
  return count;
}

/// Moves the landmarks that follow the object from the matches to `on_object`.
std::vector<LandmarkMatch> without_object(const RectifiedStereo& stereo, std::vector<LandmarkMatch> matches,
                                          const Pose& scene, const Pose& object, std::vector<std::size_t>& on_object) {
  const std::vector<bool> follows = follows_object(stereo, matches, scene, object);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (follows[i]) {
      on_object.push_back(matches[i].landmark);
    } else {
      matches[kept++] = matches[i];
    }
  }
  matches.resize(kept);
  return matches;
}

/// Whether most inliers of a motion are new, and it was not predicted.
bool is_new(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches, const MotionFit& fit,
            const MotionPrediction& prediction) {
  if (!prediction.from_measured_motion || !is_of_young_landmarks(matches, fit)) return false;
  const auto agrees = [&](const Pose& start) { return is_as_predicted(stereo, matches, fit, start); };
  return !agrees(prediction.motion) &&
         std::none_of(prediction.other_starts.begin(), prediction.other_starts.end(), agrees);
}

}  // namespace

/// Whether few landmarks scatter about the motion as wrong matches would, which lie anywhere within the search radius.
/// After a gap any motion is possible, so that few wrong ones may agree by chance, too.
bool MotionMeasurer::may_be_by_chance(const RectifiedStereo& stereo, const LandmarkMemory& map, const MotionFit& fit,
                                      const MotionPrediction& prediction) const {
  if (!options_.matching.correlation) return false;
  const auto is_few = [&](double landmarks) {
    return fit.inliers < std::max<double>(options_.motion.min_tracking_inliers, kChanceFraction * landmarks);
  };
  if (prediction.over_gap && is_few(count_in_view(stereo, map, fit.previous_from_current, WhichLandmarks::all)))
    return true;
  return is_few(static_cast<double>(map.landmarks.size())) &&
         fit.rms_px > kChanceRadiusFraction * options_.matching.correlation_radius_px;
}

/// Whether established landmarks that should be in view do not follow a motion: it may be that of an object.
bool MotionMeasurer::contradicts_established(const RectifiedStereo& stereo, const LandmarkMemory& map,
                                             const std::vector<LandmarkMatch>& matches, const MotionFit& fit) const {
  const int expected = count_in_view(stereo, map, fit.previous_from_current, WhichLandmarks::established);
  int agreeing = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) agreeing += fit.inlier[i] && matches[i].established;
  return expected >= options_.motion.min_inliers && agreeing < kMinAgreeingFraction * expected;
}

void MotionMeasurer::decide_status(const RectifiedStereo& stereo, const std::string& doubt,
                                   MotionMeasurement& measured) const {
  const MotionFit& fit = measured.fit;
  const std::vector<LandmarkMatch>& matches = measured.kept;
  measured.previous_from_current = {fit.previous_from_current, fit.covariance};
  measured.status = TrackingStatus::degraded;
  if (fit.inliers < options_.motion.min_tracking_inliers) {
    measured.reason = fmt::format("only {} landmarks agree on the motion", fit.inliers);
    return;
  }
  if (2 * fit.inliers < static_cast<int>(matches.size())) {
    measured.reason = fmt::format("only {} of {} matches agree on the motion", fit.inliers, matches.size());
    return;
  }
  int both = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) both += fit.inlier[i] && matches[i].cameras == MeasuredIn::both;
  if (2 * both < fit.inliers) {
    measured.reason = fmt::format("only {} of {} landmarks are seen by both cameras", both, fit.inliers);
    return;
  }
  if (!doubt.empty()) {
    measured.reason = doubt;
    return;
  }
  measured.status = TrackingStatus::tracking;
  if (!options_.stationary.detect) return;
  const double flow = mean_flow(stereo, matches, fit);
  if (flow > options_.stationary.max_flow_px || !agrees_with_rest(fit)) return;
  // The anchors are not moved while the rover is stationary, so a slow creep accumulates until it exceeds the limit.
  measured.status = TrackingStatus::stationary;
  measured.reason = fmt::format("the image has shifted by {:.2f} px", flow);
  measured.previous_from_current.pose = Pose();
}

MotionMeasurement MotionMeasurer::measure(const LandmarkFrame& previous, const StereoImages& images,
                                          const ImagePyramid& pyramid, ImageSide side,
                                          const MotionPrediction& prediction, bool trusts_new) {
  Stopwatch watch;
  MotionMeasurement measured;
  const std::size_t landmarks = previous.map.landmarks.size();
  CoarseMotion start = coarse_.estimate(previous, images, pyramid, side, prediction);
  const Pose& motion = start.previous_from_current;
  std::vector<LandmarkMatch>& matches = measured.kept;
  matches = options_.matching.correlation ? matcher_.by_correlation(previous.map, images, motion.inverse(), side)
                                          : start.matches;
  if (start.object) {
    without_object(images.geometry, start.matches, motion, *start.object, measured.on_object);
    matches = without_object(images.geometry, std::move(matches), motion, *start.object, measured.on_object);
  }
  if (options_.matching.rigidity) matches = keep_rigid(images.geometry, std::move(matches));
  add_noise_floor(options_.motion, images.geometry, motion, matches);
  measured.matches = static_cast<int>(matches.size());
  measured.times.match = watch.lap();

  std::optional<MotionFit> fit = estimator_.fine(images.geometry, matches, motion, prediction.offset);
  measured.times.estimate = watch.lap();
  if (!fit || fit->inliers < options_.motion.min_inliers ||
      may_be_by_chance(images.geometry, previous.map, *fit, prediction)) {
    measured.reason = fmt::format("{} landmarks, {} matches, {} agree on a motion", landmarks, matches.size(),
                                  fit ? fit->inliers : 0);
    return measured;
  }
  const bool undisputed = fit->inliers >= kMinUndisputedFraction * static_cast<double>(landmarks);
  if (undisputed && !start.object) start.doubt.clear();
  measured.is_new = is_new(images.geometry, matches, *fit, prediction);
  if (measured.is_new && !start.object && contradicts_established(images.geometry, previous.map, matches, *fit)) {
    start.doubt =
        fmt::format("most of the {} landmarks that agree are new, and their motion was not predicted", fit->inliers);
    measured.untrusted = !trusts_new;
    if (measured.untrusted) {
      measured.reason = std::move(start.doubt);
      return measured;
    }
  }
  measured.ambiguous = !start.doubt.empty() && !start.object;
  measured.fit = *std::move(fit);
  measured.features = std::move(start.features);
  measured.feature_of = std::move(start.feature_of);
  decide_status(images.geometry, start.doubt, measured);
  return measured;
}

}  // namespace spartan::internal
