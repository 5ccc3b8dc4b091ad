#include "spartan/odometry/odometer.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>

#include "spartan/core/stage_clock.h"
#include "spartan/odometry/internal/coarse_motion.h"
#include "spartan/odometry/internal/detection/landmark_detector.h"
#include "spartan/odometry/internal/landmark_manager.h"
#include "spartan/odometry/internal/landmark_matcher.h"
#include "spartan/odometry/internal/landmark_reconstructor.h"
#include "spartan/odometry/internal/landmarks/odometer_memory.h"
#include "spartan/odometry/internal/matching/smoothed_image.h"
#include "spartan/odometry/internal/motion_estimator.h"
#include "spartan/odometry/internal/rival_motion.h"

namespace spartan {

using namespace internal;

namespace {

/// Standard deviations of a motion that was not measured; larger than any motion between two frames of a rover.
constexpr double kLostTranslation_m = 1.0, kLostRotation_rad = 0.5;
/// The latest motion is extrapolated to at most this many times its duration.
constexpr double kMostSpans = 2;
/// The reference is kept over so many frames that are lost though they have landmarks.
constexpr int kMostLostFrames = 10;
/// Wrong matches, uniformly distributed over the search radius r, have an rms of r/2 in each coordinate; a fit to few
/// of them lowers it. Empirical.
constexpr double kChanceRadiusFraction = 0.25;
/// Wrong matches are not more than this fraction of the landmarks; empirical.
constexpr double kChanceFraction = 0.1;
/// Landmarks are added where more than this fraction of them is missing; empirical.
constexpr double kMaxMissingFraction = 0.05;
/// The prediction is kept over so many consecutive frames whose motion may be that of an object; empirical.
constexpr int kMaxAmbiguousFrames = 3;
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

}  // namespace

std::string_view name_of(TrackingStatus status) {
  switch (status) {
    case TrackingStatus::tracking:
      return "tracking";
    case TrackingStatus::degraded:
      return "degraded";
    case TrackingStatus::lost:
      return "lost";
    case TrackingStatus::stationary:
      return "standing";
  }
  return "unknown";
}

struct Odometer::State {
  State(const OdometryOptions& o, ThreadPool w)
      : options(o),
        workers(std::move(w)),
        detector(make_landmark_detector(options.detection, workers)),
        reconstruction(options.reconstruction),
        matching(options.matching, reconstruction, workers),
        estimation(options.motion),
        coarse(options, *detector, matching, estimation, workers),
        manager(options) {}

  OdometryOptions options;
  ThreadPool workers;
  std::unique_ptr<LandmarkDetector> detector;
  LandmarkReconstructor reconstruction;
  LandmarkMatcher matching;
  MotionEstimator estimation;
  CoarseMotionEstimator coarse;
  LandmarkManager manager;
  SmoothedImage left_smooth, right_smooth;
  ImagePyramid pyramid, right_pyramid;  ///< of the current images; that of the right one where it is needed
  OdometerMemory memory;

  std::optional<std::string> defect_of(const RectifiedPair& pair) const;
  MotionPrediction predict(Stamp now) const;
  /// Whether the latest motion may be that of an object.
  bool keeps_prediction() const {
    return memory.ambiguous_frames > 0 && memory.ambiguous_frames <= kMaxAmbiguousFrames;
  }
  DisparityOffset predicted_offset() const;
  void add_landmarks(const StereoImages& images, LandmarkMemory& map, MotionEstimate& estimate, Stopwatch& watch);
  bool measure_in_right(const StereoImages& images, const MotionPrediction& prediction, MotionEstimate& estimate,
                        Stopwatch& watch);
  bool measure_from_latest(const StereoImages& images, const MotionPrediction& prediction, MotionEstimate& estimate,
                           Stopwatch& watch);
  void measure_from_any(const StereoImages& images, const MotionPrediction& prediction, MotionEstimate& estimate,
                        Stopwatch& watch);
  void advance(const StereoImages& images, bool usable, bool same_geometry, MotionEstimate& estimate, Stopwatch& watch);
  void measure(const StereoImages& images, ImageSide side, const MotionPrediction& prediction, MotionEstimate& estimate,
               Stopwatch& watch);
  bool may_be_by_chance(const MotionFit& fit) const;
  std::string doubt_of_age(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                           const MotionFit& fit, const MotionPrediction& prediction) const;
  std::vector<LandmarkMatch> discard_object(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                                            const Pose& scene, const Pose& object);
  void decide_status(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches, const MotionFit& fit,
                     const std::string& doubt, MotionEstimate& estimate) const;
};

/// Why a pair cannot be used; std::nullopt where it can.
std::optional<std::string> Odometer::State::defect_of(const RectifiedPair& pair) const {
  if (pair.left.empty() && pair.right.empty()) return "both images are missing";
  const bool both = !pair.left.empty() && !pair.right.empty();
  if (both && pair.left.size() != pair.right.size()) return "left and right image differ in size";
  if (!(pair.geometry.focal_px > 0) || !(pair.geometry.baseline_m > 0)) return "the pair has no geometry";
  return std::nullopt;
}

/// Constant-velocity model: the latest measured motion, scaled to the time since the latest frame, but at most
/// kMostSpans times: a rover that was not observed for long has rather stopped than driven on.
MotionPrediction Odometer::State::predict(Stamp now) const {
  const bool is_reference = memory.frames_since_reference == 0;
  const Pose reference_from_latest = is_reference ? Pose() : memory.reference_from_latest;
  const double elapsed_s = seconds_between(is_reference ? memory.reference.stamp : memory.latest.stamp, now);
  MotionPrediction prediction{reference_from_latest, {}, memory.velocity_span_s > 0, predicted_offset()};
  if (!(memory.velocity_span_s > 0) || !(elapsed_s > 0)) return prediction;
  const double spans = elapsed_s / memory.velocity_span_s;
  const auto moved = [&](double by) { return reference_from_latest * exp_se3(memory.last_motion * by); };
  prediction.motion = moved(std::min(spans, kMostSpans));
  // A rover that moves in steps moves on by one step, however long it has stopped; another one has driven on.
  prediction.other_starts.push_back(moved(1));
  if (spans > kMostSpans) prediction.other_starts.push_back(moved(spans));
  return prediction;
}

/// Prior of the disparity offset for the current frame: a random walk, bounded by the prior of the calibration.
DisparityOffset Odometer::State::predicted_offset() const {
  const double sigma = options.motion.offset_sigma_px, drift = options.motion.offset_drift_px;
  if (!(sigma > 0)) return {};
  if (!(memory.offset.variance > 0)) return {0, sigma * sigma};
  return {memory.offset.value, std::min(memory.offset.variance + drift * drift, sigma * sigma)};
}

/// New landmarks where there are none. Those that were re-anchored get their anchor here, too.
void Odometer::State::add_landmarks(const StereoImages& images, LandmarkMemory& map, MotionEstimate& estimate,
                                    Stopwatch& watch) {
  const int missing = options.detection.landmarks - static_cast<int>(map.landmarks.size());
  const bool both = !images.left.empty() && !images.right.empty();
  std::vector<ReconstructedFeature> features;
  if (both && missing > kMaxMissingFraction * options.detection.landmarks) {
    std::vector<Eigen::Vector2f> taken;
    taken.reserve(map.landmarks.size());
    for (const Landmark& landmark : map.landmarks) taken.push_back(landmark.pixel.cast<float>());
    // Some have no disparity.
    const int count = missing + missing / 4;
    const std::vector<Feature>& detected = detector->detect(images.left, images.left_mask, {count, taken});
    estimate.times.detect += watch.lap();
    features = reconstruction.reconstruct(images, detected, workers);
  }
  manager.add(map, images, features);
  estimate.times.reconstruct += watch.lap();
}

/// Whether few landmarks scatter about the motion as wrong matches would, which lie anywhere within the search radius.
bool Odometer::State::may_be_by_chance(const MotionFit& fit) const {
  const auto landmarks = static_cast<double>(memory.reference.map.landmarks.size());
  const double few = std::max<double>(options.motion.min_tracking_inliers, kChanceFraction * landmarks);
  return options.matching.correlation && fit.inliers < few &&
         fit.rms_px > kChanceRadiusFraction * options.matching.correlation_radius_px;
}

/// Why a motion may be that of an object that has come into view: established landmarks do not follow it. Empty
/// otherwise.
std::string Odometer::State::doubt_of_age(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                                          const MotionFit& fit, const MotionPrediction& prediction) const {
  if (!prediction.from_measured_motion || !is_of_young_landmarks(matches, fit)) return {};
  const auto& all = memory.reference.map.landmarks;
  const auto established = std::count_if(all.begin(), all.end(), [](const Landmark& l) { return is_established(l); });
  if (established < options.motion.min_inliers) return {};
  std::vector<Pose> starts = prediction.other_starts;
  starts.push_back(prediction.motion);
  for (const Pose& start : starts)
    if (is_as_predicted(stereo, matches, fit, start)) return {};
  return fmt::format("most of the {} landmarks that agree are new, and their motion was not predicted", fit.inliers);
}

/// The matches of the scene. Landmarks of the object are removed with the next update, because an anchor on it does not
/// move with the scene.
std::vector<LandmarkMatch> Odometer::State::discard_object(const RectifiedStereo& stereo,
                                                           const std::vector<LandmarkMatch>& matches, const Pose& scene,
                                                           const Pose& object) {
  const std::vector<bool> follows = follows_object(stereo, matches, scene, object);
  std::vector<LandmarkMatch> kept;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (follows[i]) {
      discard(memory.reference.map.landmarks[matches[i].landmark]);
    } else {
      kept.push_back(matches[i]);
    }
  }
  return kept;
}

void Odometer::State::decide_status(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                                    const MotionFit& fit, const std::string& doubt, MotionEstimate& estimate) const {
  estimate.reason.clear();
  estimate.previous_from_current = fit.previous_from_current;
  estimate.covariance = fit.covariance;
  if (fit.inliers < options.motion.min_tracking_inliers) {
    estimate.status = TrackingStatus::degraded;
    estimate.reason = fmt::format("only {} landmarks agree on the motion", fit.inliers);
    return;
  }
  if (2 * fit.inliers < static_cast<int>(matches.size())) {
    estimate.status = TrackingStatus::degraded;
    estimate.reason = fmt::format("only {} of {} matches agree on the motion", fit.inliers, matches.size());
    return;
  }
  int both = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) both += fit.inlier[i] && matches[i].cameras == MeasuredIn::both;
  if (2 * both < fit.inliers) {
    estimate.status = TrackingStatus::degraded;
    estimate.reason = fmt::format("only {} of {} landmarks are seen by both cameras", both, fit.inliers);
    return;
  }
  if (!doubt.empty()) {
    estimate.status = TrackingStatus::degraded;
    estimate.reason = doubt;
    return;
  }
  estimate.status = TrackingStatus::tracking;
  if (!options.stationary.detect) return;
  const double flow = mean_flow(stereo, matches, fit);
  if (flow > options.stationary.max_flow_px) return;
  // The anchors are not moved while the rover is stationary, so a slow creep accumulates until it exceeds the limit.
  estimate.status = TrackingStatus::stationary;
  estimate.reason = fmt::format("the image has shifted by {:.2f} px", flow);
  estimate.previous_from_current = Pose();
}

/// In the right image, the landmarks stay those of the reference: they need a left image.
void Odometer::State::measure(const StereoImages& images, ImageSide side, const MotionPrediction& prediction,
                              MotionEstimate& estimate, Stopwatch& watch) {
  const bool left = side == ImageSide::left;
  LandmarkMemory& map = memory.reference.map;
  const std::size_t landmarks = map.landmarks.size();
  CoarseMotion start = coarse.estimate(memory.reference, images, left ? pyramid : right_pyramid, side, prediction);
  std::vector<LandmarkMatch> matches =
      options.matching.correlation ? matching.by_correlation(map, images, start.previous_from_current.inverse(), side)
                                   : start.matches;
  if (start.object) {
    discard_object(images.geometry, start.matches, start.previous_from_current, *start.object);
    matches = discard_object(images.geometry, matches, start.previous_from_current, *start.object);
  }
  if (options.matching.rigidity) matches = keep_rigid(images.geometry, std::move(matches));
  add_noise_floor(options.motion, images.geometry, start.previous_from_current, matches);
  estimate.matches = static_cast<int>(matches.size());
  estimate.times.match += watch.lap();

  const std::optional<MotionFit> fit =
      estimation.fine(images.geometry, matches, start.previous_from_current, prediction.offset);
  if (!fit || fit->inliers < options.motion.min_inliers || may_be_by_chance(*fit)) {
    estimate.status = TrackingStatus::lost;
    estimate.reason = fmt::format("{} landmarks, {} matches, {} agree on a motion", landmarks, matches.size(),
                                  fit ? fit->inliers : 0);
    estimate.times.estimate += watch.lap();
    return;
  }
  const bool undisputed = fit->inliers >= kMinUndisputedFraction * static_cast<double>(landmarks);
  if (undisputed && !start.object) start.doubt.clear();
  if (start.doubt.empty()) start.doubt = doubt_of_age(images.geometry, matches, *fit, prediction);
  const bool ambiguous = !start.doubt.empty() && !start.object;
  memory.ambiguous_frames = ambiguous ? memory.ambiguous_frames + 1 : 0;
  estimate.inliers = fit->inliers;
  estimate.rms_px = fit->rms_px;
  decide_status(images.geometry, matches, *fit, start.doubt, estimate);
  if (left) {
    memory.offset = fit->offset;
    move_anchors(map, estimate.previous_from_current);
    const bool establishes = estimate.status != TrackingStatus::stationary && !ambiguous;
    manager.update(map, images, matches, *fit, establishes, start.features, start.feature_of);
  }
  estimate.times.estimate += watch.lap();
}

/// Measures the motion where the left image is of no use; the landmarks stay those of the reference.
bool Odometer::State::measure_in_right(const StereoImages& images, const MotionPrediction& prediction,
                                       MotionEstimate& estimate, Stopwatch& watch) {
  if (images.right.empty()) return false;
  right_pyramid.compute(images.right_smooth);
  MotionEstimate in_right = estimate;
  measure(images, ImageSide::right, prediction, in_right, watch);
  if (in_right.status == TrackingStatus::lost) return false;
  estimate = std::move(in_right);
  estimate.keeps_reference = true;
  return true;
}

/// Measures the motion from the latest frame, which was lost. Where that succeeds it is the reference.
bool Odometer::State::measure_from_latest(const StereoImages& images, const MotionPrediction& prediction,
                                          MotionEstimate& estimate, Stopwatch& watch) {
  if (memory.latest.map.landmarks.empty()) return false;
  const Pose latest_from_reference = memory.reference_from_latest.inverse();
  MotionPrediction prediction_from_latest = prediction;
  prediction_from_latest.motion = latest_from_reference * prediction.motion;
  for (Pose& start : prediction_from_latest.other_starts) start = latest_from_reference * start;
  std::swap(memory.reference, memory.latest);
  MotionEstimate from_latest = estimate;
  measure(images, ImageSide::left, prediction_from_latest, from_latest, watch);
  if (from_latest.status == TrackingStatus::lost) {
    std::swap(memory.reference, memory.latest);
    return false;
  }
  estimate = std::move(from_latest);
  estimate.from = memory.reference.stamp;
  return true;
}

void Odometer::State::measure_from_any(const StereoImages& images, const MotionPrediction& prediction,
                                       MotionEstimate& estimate, Stopwatch& watch) {
  if (images.left.empty()) {
    estimate.status = TrackingStatus::lost;
    estimate.reason = "the left image is missing";
  } else {
    measure(images, ImageSide::left, prediction, estimate, watch);
  }
  if (estimate.status != TrackingStatus::lost || measure_in_right(images, prediction, estimate, watch)) return;
  if (!images.left.empty()) measure_from_latest(images, prediction, estimate, watch);
}

/// Makes the current frame the reference. Where it is lost the reference stays, and the landmarks of the frame are kept
/// beside it; where it was measured in the right image the reference stays, too.
void Odometer::State::advance(const StereoImages& images, bool usable, bool same_geometry, MotionEstimate& estimate,
                              Stopwatch& watch) {
  const bool lost = estimate.status == TrackingStatus::lost, in_right = !lost && estimate.keeps_reference;
  LandmarkFrame& frame = lost || in_right ? memory.latest : memory.reference;
  frame.stamp = estimate.to;
  if (lost || in_right) frame.map = {};
  if (usable) memory.geometry = images.geometry;
  if (usable && !in_right && !images.left.empty()) {
    add_landmarks(images, frame.map, estimate, watch);
    std::swap(frame.pyramid, pyramid);
  }
  // An unusable pair says nothing on the geometry. Frames without landmarks, such as dark ones, cannot be a reference.
  if (lost) {
    const bool replaced = memory.frames_since_reference >= kMostLostFrames && !frame.map.landmarks.empty();
    estimate.keeps_reference =
        !estimate.first && (same_geometry || !usable) && !replaced && !memory.reference.map.landmarks.empty();
  }
  if (estimate.keeps_reference) {
    ++memory.frames_since_reference;
    memory.reference_from_latest = estimate.previous_from_current;
    return;
  }
  if (lost) std::swap(memory.reference, memory.latest);
  memory.frames_since_reference = 0;
  memory.latest = {};
}

Result<Odometer> Odometer::create(const OdometryOptions& options, ThreadPool workers) {
  if (Status valid = validate(options, "odometry options"); !valid) return failure(valid);
  return Odometer(std::make_unique<State>(options, std::move(workers)));
}

Odometer::Odometer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Odometer::Odometer(Odometer&&) noexcept = default;
Odometer& Odometer::operator=(Odometer&&) noexcept = default;
Odometer::~Odometer() = default;

MotionEstimate Odometer::add(const RectifiedPair& pair, const std::optional<Pose>& predicted,
                             ImageView<const float> disparity, const std::optional<Pose>& alternative) {
  State& s = *state_;
  Stopwatch all, watch;
  MotionEstimate estimate;
  estimate.to = pair.stamp;
  estimate.first = !s.memory.started;
  estimate.from = s.memory.started ? s.memory.reference.stamp : pair.stamp;
  MotionPrediction prediction = s.predict(pair.stamp);
  if (predicted) prediction.motion = *predicted;
  if (alternative) prediction.other_starts.insert(prediction.other_starts.begin(), *alternative);

  const std::optional<std::string> defect = s.defect_of(pair);
  StereoImages images{pair.geometry, pair.left, pair.right, {}, {}, pair.left_mask, pair.right_mask, disparity};
  const bool same_geometry = s.memory.geometry == pair.geometry;
  if (defect) {
    estimate.status = TrackingStatus::lost;
    estimate.reason = *defect;
  } else {
    s.left_smooth.compute(pair.left, s.workers);
    s.right_smooth.compute(pair.right, s.workers);
    images.left_smooth = s.left_smooth.view();
    images.right_smooth = s.right_smooth.view();
    if (!images.left.empty()) s.pyramid.compute(images.left_smooth);
    if (estimate.first) {
      // Nothing to measure against.
    } else if (same_geometry) {
      s.measure_from_any(images, prediction, estimate, watch);
    } else {
      estimate.status = TrackingStatus::lost;
      estimate.reason = "the geometry of the pair has changed";
    }
  }
  if (estimate.status == TrackingStatus::lost && !estimate.first) {
    estimate.previous_from_current = prediction.motion;
    estimate.covariance.diagonal() << Eigen::Vector3d::Constant(kLostTranslation_m * kLostTranslation_m),
        Eigen::Vector3d::Constant(kLostRotation_rad * kLostRotation_rad);
  } else if (!estimate.first && !s.keeps_prediction()) {
    s.memory.last_motion = log_se3(estimate.previous_from_current);
    s.memory.velocity_span_s = seconds_between(estimate.from, estimate.to);
  }
  s.advance(images, !defect, same_geometry, estimate, watch);
  s.memory.started = true;
  estimate.landmarks = static_cast<int>(s.memory.reference.map.landmarks.size());
  estimate.times.total = all.lap();
  return estimate;
}

Bytes Odometer::save() const {
  return state_->memory.save();
}

Status Odometer::restore(const Bytes& state) {
  Result<OdometerMemory> memory = OdometerMemory::restore(state);
  if (!memory) return failure(memory);
  state_->memory = *std::move(memory);
  return {};
}

}  // namespace spartan
