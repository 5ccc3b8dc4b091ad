#include "spartan/odometry/odometer.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>

#include "spartan/core/stage_clock.h"
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
/// With fewer inliers the coarse motion is replaced by the prediction; empirical.
constexpr int kMinCoarseInliers = 10;
/// With fewer inliers inside of the gates, the descriptors are matched over the whole image as well; empirical.
constexpr int kSufficientCoarseInliers = 30;

/// The latest motion is extrapolated to at most this many times its duration.
constexpr double kMostSpans = 2;
/// Landmarks are added where more than this fraction of them is missing; empirical.
constexpr double kMaxMissingFraction = 0.05;
/// The prediction is kept over so many consecutive frames whose motion may be that of an object; empirical.
constexpr int kMaxAmbiguousFrames = 3;
/// The motion of the scene has at least this fraction of the inliers that an object has; empirical.
constexpr double kMinSceneFraction = 0.5;
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
        manager(options) {}

  OdometryOptions options;
  ThreadPool workers;
  std::unique_ptr<LandmarkDetector> detector;
  LandmarkReconstructor reconstruction;
  LandmarkMatcher matching;
  MotionEstimator estimation;
  LandmarkManager manager;
  SmoothedImage left_smooth, right_smooth;
  ImagePyramid pyramid;  ///< of the current left image
  std::vector<ReconstructedFeature> features;
  OdometerMemory memory;

  std::optional<std::string> defect_of(const RectifiedPair& pair) const;
  Pose predict(Stamp now) const;
  /// Whether the latest motion may be that of an object.
  bool keeps_prediction() const {
    return memory.ambiguous_frames > 0 && memory.ambiguous_frames <= kMaxAmbiguousFrames;
  }
  DisparityOffset predicted_offset() const;
  void detect(const StereoImages& images);
  void reconstruct(const StereoImages& images);
  void add_landmarks(const StereoImages& images, MotionEstimate& estimate, Stopwatch& watch);
  void measure(const StereoImages& images, const Pose& predicted, MotionEstimate& estimate, Stopwatch& watch);
  struct CoarseMotion {
    Pose previous_from_current;
    std::vector<LandmarkMatch> matches;
    std::vector<int> feature_of;  ///< index of the feature of each landmark; −1: none
    std::string doubt;            ///< why this may be the motion of an object; empty otherwise
    std::optional<Pose> object;   ///< its motion, where it is known
  };
  CoarseMotion coarse_motion(const StereoImages& images, const Pose& predicted);
  bool is_false_rival(const StereoImages& images, const Pose& rival, const Pose& largest);
  std::vector<LandmarkMatch> discard_object(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                                            const Pose& scene, const Pose& object);
  void add_noise_floor(std::vector<LandmarkMatch>& matches) const;
  void decide_status(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches, const MotionFit& fit,
                     const std::string& doubt, MotionEstimate& estimate) const;
};

/// Why a pair cannot be used; std::nullopt where it can.
std::optional<std::string> Odometer::State::defect_of(const RectifiedPair& pair) const {
  if (pair.left.empty() || pair.right.empty()) return "an image is empty";
  if (pair.left.size() != pair.right.size()) return "left and right image differ in size";
  if (!(pair.geometry.focal_px > 0) || !(pair.geometry.baseline_m > 0)) return "the pair has no geometry";
  return std::nullopt;
}

/// Constant-velocity model: the latest measured motion, scaled to the time since then, but at most kMostSpans times: a
/// rover that was not observed for long has rather stopped than driven on.
Pose Odometer::State::predict(Stamp now) const {
  const double elapsed_s = seconds_between(memory.stamp, now);
  if (!(memory.velocity_span_s > 0) || !(elapsed_s > 0)) return {};
  return exp_se3(memory.last_motion * std::min(elapsed_s / memory.velocity_span_s, kMostSpans));
}

/// Prior of the disparity offset for the current frame: a random walk, bounded by the prior of the calibration.
DisparityOffset Odometer::State::predicted_offset() const {
  const double sigma = options.motion.offset_sigma_px, drift = options.motion.offset_drift_px;
  if (!(sigma > 0)) return {};
  if (!(memory.offset.variance > 0)) return {0, sigma * sigma};
  return {memory.offset.value, std::min(memory.offset.variance + drift * drift, sigma * sigma)};
}

/// Features of the whole image with their disparities.
void Odometer::State::detect(const StereoImages& images) {
  features.clear();
  for (const Feature& feature : detector->detect(images.left, images.left_mask))
    features.push_back({feature, std::nullopt});
  reconstruct(images);
}

/// New landmarks where there are none.
void Odometer::State::add_landmarks(const StereoImages& images, MotionEstimate& estimate, Stopwatch& watch) {
  const int missing = options.detection.landmarks - static_cast<int>(memory.map.landmarks.size());
  features.clear();
  if (missing > kMaxMissingFraction * options.detection.landmarks) {
    std::vector<Eigen::Vector2f> taken;
    taken.reserve(memory.map.landmarks.size());
    for (const Landmark& landmark : memory.map.landmarks) taken.push_back(landmark.pixel.cast<float>());
    // Some have no disparity.
    const int count = missing + missing / 4;
    for (const Feature& feature : detector->detect(images.left, images.left_mask, {count, taken}))
      features.push_back({feature, std::nullopt});
  }
  estimate.times.detect += watch.lap();
  reconstruct(images);
  manager.add(memory.map, images, features);
  estimate.times.reconstruct += watch.lap();
}

void Odometer::State::reconstruct(const StereoImages& images) {
  workers.parallel_for(0, static_cast<int>(features.size()), 16, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      ReconstructedFeature& f = features[static_cast<std::size_t>(i)];
      f.stereo = reconstruction.reconstruct(images, static_cast<int>(std::lround(f.feature.x)),
                                            static_cast<int>(std::lround(f.feature.y)));
    }
  });
}

/// Coarse motion from some landmarks that are found near their predicted positions, else from descriptors; the
/// prediction where too few agree.
Odometer::State::CoarseMotion Odometer::State::coarse_motion(const StereoImages& images, const Pose& predicted) {
  if (!options.matching.descriptors) return {predicted, {}, {}, {}, {}};
  struct Attempt {
    std::vector<int> feature_of;
    std::vector<LandmarkMatch> matches;
    std::optional<MotionFit> fit;
    int inliers() const { return fit ? fit->inliers : 0; }
  };
  const RectifiedStereo& stereo = images.geometry;
  Attempt best;
  const auto is_sufficient = [](const Attempt& a) {
    return a.inliers() >= kSufficientCoarseInliers && 2 * a.inliers() >= static_cast<int>(a.matches.size());
  };
  // A rover that moves in steps moves on by one step, however long it has stopped.
  for (const Pose& start : {predicted, exp_se3(memory.last_motion)}) {
    if (!options.matching.correlation || is_sufficient(best)) break;
    Attempt found;
    found.matches = matching.by_pyramid(memory.map, images, memory.pyramid, pyramid, start.inverse());
    found.fit = estimation.coarse(stereo, found.matches);
    if (found.inliers() > best.inliers()) best = std::move(found);
  }
  if (!is_sufficient(best)) {
    detect(images);
    const auto attempt = [&](const std::optional<Pose>& current_from_previous) {
      Attempt result;
      result.feature_of = matching.by_descriptor(memory.map, features, stereo, current_from_previous);
      result.matches = matching.coarse_matches(memory.map, features, result.feature_of);
      result.fit = estimation.coarse(stereo, result.matches);
      return result;
    };
    Attempt described = attempt(predicted.inverse());
    if (described.inliers() < kSufficientCoarseInliers) {
      Attempt ungated = attempt(std::nullopt);
      if (ungated.inliers() > described.inliers()) described = std::move(ungated);
    }
    if (described.inliers() > best.inliers()) best = std::move(described);
  }
  std::string doubt;
  std::optional<Pose> object;
  if (best.inliers() >= kMinCoarseInliers && memory.velocity_span_s > 0) {
    if (const auto rival = find_rival(estimation, stereo, best.matches, *best.fit, predicted)) {
      ChosenMotion chosen = choose_motion(best.matches, *best.fit, *rival);
      if (!chosen.object || !is_false_rival(images, chosen.fit.previous_from_current, *chosen.object)) {
        best.fit = std::move(chosen.fit);
        doubt = std::move(chosen.reason);
        object = chosen.object;
      }
    }
  }
  const Pose motion = best.inliers() >= kMinCoarseInliers ? best.fit->previous_from_current : predicted;
  return {motion, std::move(best.matches), std::move(best.feature_of), std::move(doubt), object};
}

/// Whether a rival consists of wrong matches: then far fewer landmarks have their patches where it predicts them than
/// where the largest set does.
bool Odometer::State::is_false_rival(const StereoImages& images, const Pose& rival, const Pose& largest) {
  if (!options.matching.correlation) return false;
  const auto inliers = [&](const Pose& motion) {
    std::vector<LandmarkMatch> matches = matching.by_correlation(memory.map, images, motion.inverse());
    if (options.matching.rigidity) matches = keep_rigid(images.geometry, std::move(matches));
    add_noise_floor(matches);
    const auto fit = estimation.fine(images.geometry, matches, motion, predicted_offset());
    return fit ? fit->inliers : 0;
  };
  return inliers(rival) < kMinSceneFraction * inliers(largest);
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
      discard(memory.map.landmarks[matches[i].landmark]);
    } else {
      kept.push_back(matches[i]);
    }
  }
  return kept;
}

/// Adds the specified noise, which the residual of a single patch alignment does not show.
void Odometer::State::add_noise_floor(std::vector<LandmarkMatch>& matches) const {
  const double pixel = options.motion.pixel_sigma_px, disparity = options.motion.disparity_sigma_px;
  for (LandmarkMatch& match : matches) {
    match.covariance.diagonal() += Eigen::Vector3d(pixel * pixel, pixel * pixel, disparity * disparity);
  }
}

void Odometer::State::decide_status(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                                    const MotionFit& fit, const std::string& doubt, MotionEstimate& estimate) const {
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

void Odometer::State::measure(const StereoImages& images, const Pose& predicted, MotionEstimate& estimate,
                              Stopwatch& watch) {
  const std::size_t landmarks = memory.map.landmarks.size();
  auto [start, coarse_matches, feature_of, doubt, object] = coarse_motion(images, predicted);
  std::vector<LandmarkMatch> matches =
      options.matching.correlation ? matching.by_correlation(memory.map, images, start.inverse()) : coarse_matches;
  if (object) {
    discard_object(images.geometry, coarse_matches, start, *object);
    matches = discard_object(images.geometry, matches, start, *object);
  }
  if (options.matching.rigidity) matches = keep_rigid(images.geometry, std::move(matches));
  add_noise_floor(matches);
  estimate.matches = static_cast<int>(matches.size());
  estimate.times.match = watch.lap();

  const std::optional<MotionFit> fit = estimation.fine(images.geometry, matches, start, predicted_offset());
  if (!fit || fit->inliers < options.motion.min_inliers) {
    estimate.status = TrackingStatus::lost;
    estimate.reason = fmt::format("{} landmarks, {} matches, {} agree on a motion", memory.map.landmarks.size(),
                                  matches.size(), fit ? fit->inliers : 0);
    estimate.times.estimate = watch.lap();
    return;
  }
  const bool undisputed = fit->inliers >= kMinUndisputedFraction * static_cast<double>(landmarks);
  if (undisputed && !object) doubt.clear();
  memory.ambiguous_frames = doubt.empty() || object ? 0 : memory.ambiguous_frames + 1;
  estimate.inliers = fit->inliers;
  estimate.rms_px = fit->rms_px;
  decide_status(images.geometry, matches, *fit, doubt, estimate);
  memory.offset = fit->offset;
  move_anchors(memory.map, estimate.previous_from_current);
  manager.update(memory.map, images, matches, *fit, features, feature_of);
  estimate.times.estimate = watch.lap();
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
                             ImageView<const float> disparity) {
  State& s = *state_;
  Stopwatch all, watch;
  MotionEstimate estimate;
  estimate.to = pair.stamp;
  estimate.first = !s.memory.started;
  estimate.from = s.memory.started ? s.memory.stamp : pair.stamp;
  const Pose prediction = predicted ? *predicted : s.predict(pair.stamp);

  const std::optional<std::string> defect = s.defect_of(pair);
  if (defect) {
    estimate.status = TrackingStatus::lost;
    estimate.reason = *defect;
  } else {
    StereoImages images{pair.geometry, pair.left, pair.right, {}, {}, pair.left_mask, pair.right_mask, disparity};
    s.left_smooth.compute(pair.left, s.workers);
    s.right_smooth.compute(pair.right, s.workers);
    images.left_smooth = s.left_smooth.view();
    images.right_smooth = s.right_smooth.view();
    s.pyramid.compute(images.left_smooth);
    if (!estimate.first) {
      if (s.memory.geometry == pair.geometry) {
        s.measure(images, prediction, estimate, watch);
      } else {
        estimate.status = TrackingStatus::lost;
        estimate.reason = "the geometry of the pair has changed";
      }
    }
    if (estimate.status == TrackingStatus::lost) s.memory.map = {};
    s.add_landmarks(images, estimate, watch);
    std::swap(s.memory.pyramid, s.pyramid);
    s.memory.geometry = pair.geometry;
  }

  estimate.landmarks = static_cast<int>(s.memory.map.landmarks.size());
  if (estimate.status == TrackingStatus::lost && !estimate.first) {
    estimate.previous_from_current = prediction;
    estimate.covariance.diagonal() << Eigen::Vector3d::Constant(kLostTranslation_m * kLostTranslation_m),
        Eigen::Vector3d::Constant(kLostRotation_rad * kLostRotation_rad);
  } else if (!estimate.first && !s.keeps_prediction()) {
    s.memory.last_motion = log_se3(estimate.previous_from_current);
    s.memory.velocity_span_s = seconds_between(estimate.from, estimate.to);
  }
  s.memory.started = true;
  s.memory.stamp = pair.stamp;
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
