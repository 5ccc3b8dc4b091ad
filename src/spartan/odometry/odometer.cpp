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
#include "spartan/odometry/internal/motion_measurement.h"

namespace spartan {

using namespace internal;

namespace {

/// The reference is kept over so many frames that are lost though they have landmarks.
constexpr int kMostLostFrames = 10;
/// Landmarks are added where more than this fraction of them is missing; empirical.
constexpr double kMaxMissingFraction = 0.05;
/// The prediction is kept over so many consecutive frames whose motion may be that of an object; empirical.
constexpr int kMaxAmbiguousFrames = 3;
/// So many consecutive motions of new landmarks that were not predicted are not trusted; empirical.
constexpr int kMostUntrustedFrames = 10;
/// A frame is kept for so many frames; that long, what the images show counts as blurred.
constexpr int kMostKeptFrames = 30;
/// The kept frame is searched in so many good frames that are measured from others.
constexpr int kMostSearches = 5;

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
        measurer(options, *detector, matching, estimation, workers),
        manager(options) {}

  OdometryOptions options;
  ThreadPool workers;
  std::unique_ptr<LandmarkDetector> detector;
  LandmarkReconstructor reconstruction;
  LandmarkMatcher matching;
  MotionEstimator estimation;
  MotionMeasurer measurer;
  LandmarkManager manager;
  SmoothedImage left_smooth, right_smooth;
  ImagePyramid pyramid, right_pyramid;  ///< of the current images; that of the right one where it is needed
  OdometerMemory memory;
  std::vector<LandmarkTrack> tracks;  ///< of the latest frame

  std::optional<std::string> defect_of(const RectifiedPair& pair) const;
  /// Whether the latest motion may be that of an object.
  bool keeps_prediction() const {
    return memory.ambiguous_frames > 0 && memory.ambiguous_frames <= kMaxAmbiguousFrames;
  }
  void add_landmarks(const StereoImages& images, LandmarkMemory& map, MotionEstimate& estimate);
  MotionMeasurement measure(const LandmarkFrame& previous, const StereoImages& images, ImageSide side,
                            const MotionPrediction& prediction, MotionEstimate& estimate);
  void accept(const MotionMeasurement& measured, const StereoImages& images, MotionEstimate& estimate);
  bool measure_from_kept(const StereoImages& images, const MotionPrediction& prediction, MotionEstimate& estimate);
  void measure_from_any(const StereoImages& images, const MotionPrediction& prediction, bool blurred,
                        MotionEstimate& estimate);
  void advance(const StereoImages& images, bool usable, bool same_geometry, MotionEstimate& estimate);
  void keep_tracks(const MotionMeasurement& measured);
  void keep(LandmarkFrame frame) { memory.kept = {std::move(frame), memory.reference.stamp, {}, 0, 0}; }
  void follow_kept(const MotionEstimate& estimate, const Sharpness& sharpness, bool blurred);
};

/// Why a pair cannot be used; std::nullopt where it can.
std::optional<std::string> Odometer::State::defect_of(const RectifiedPair& pair) const {
  if (pair.left.empty() && pair.right.empty()) return "both images are missing";
  const bool both = !pair.left.empty() && !pair.right.empty();
  if (both && pair.left.size() != pair.right.size()) return "left and right image differ in size";
  if (!(pair.geometry.focal_px > 0) || !(pair.geometry.baseline_m > 0)) return "the pair has no geometry";
  return std::nullopt;
}

/// New landmarks where there are none. Those that were re-anchored get their anchor here, too.
void Odometer::State::add_landmarks(const StereoImages& images, LandmarkMemory& map, MotionEstimate& estimate) {
  Stopwatch watch;
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

MotionMeasurement Odometer::State::measure(const LandmarkFrame& previous, const StereoImages& images, ImageSide side,
                                           const MotionPrediction& prediction, MotionEstimate& estimate) {
  const bool trusts_new = memory.ambiguous_frames >= kMostUntrustedFrames;
  MotionMeasurement measured = measurer.measure(previous, images, side == ImageSide::left ? pyramid : right_pyramid,
                                                side, prediction, trusts_new);
  estimate.times.match += measured.times.match;
  estimate.times.estimate += measured.times.estimate;
  return measured;
}

void Odometer::State::keep_tracks(const MotionMeasurement& measured) {
  for (std::size_t i = 0; i < measured.kept.size(); ++i) {
    const LandmarkMatch& match = measured.kept[i];
    tracks.push_back({memory.reference.map.landmarks[match.landmark].pixel.cast<float>(),
                      match.measured.head<2>().cast<float>(), measured.fit.inlier[i]});
  }
}

/// A motion from the reference. Where it was measured in the left image the landmarks of the reference are updated.
void Odometer::State::accept(const MotionMeasurement& measured, const StereoImages& images, MotionEstimate& estimate) {
  Stopwatch watch;
  memory.ambiguous_frames = measured.ambiguous ? memory.ambiguous_frames + 1 : 0;
  estimate.status = measured.status;
  estimate.reason = measured.reason;
  estimate.previous_from_current = measured.previous_from_current.pose;
  estimate.covariance = measured.previous_from_current.covariance;
  estimate.matches = measured.matches;
  estimate.inliers = measured.fit.inliers;
  estimate.rms_px = measured.fit.rms_px;
  if (estimate.keeps_reference) return;
  keep_tracks(measured);
  LandmarkMemory& map = memory.reference.map;
  memory.offset = measured.fit.offset;
  for (const std::size_t i : measured.on_object) discard(map.landmarks[i]);
  move_anchors(map, estimate.previous_from_current);
  const bool establishes = measured.status != TrackingStatus::stationary && !measured.ambiguous;
  manager.update(map, images, measured.kept, measured.fit, establishes, measured.features, measured.feature_of);
  estimate.times.estimate += watch.lap();
}

/// Measures the motion from the frame that is kept. Where that succeeds its landmarks are those of the reference.
bool Odometer::State::measure_from_kept(const StereoImages& images, const MotionPrediction& prediction,
                                        MotionEstimate& estimate) {
  if (!memory.kept.is_kept() || images.left.empty()) return false;
  const UncertainPose kept_from_reference = memory.kept.kept_from_reference;
  const MotionMeasurement measured =
      measure(memory.kept.frame, images, ImageSide::left, prediction.from(kept_from_reference.pose), estimate);
  // An object may have been in view already.
  if (measured.is_lost() || measured.status == TrackingStatus::degraded || measured.is_new) return false;
  std::swap(memory.reference, memory.kept.frame);
  memory.kept = {};
  accept(measured, images, estimate);
  const UncertainPose motion = compose(invert(kept_from_reference), measured.previous_from_current);
  estimate.previous_from_current = motion.pose;
  estimate.covariance = motion.covariance;
  // The reference and the current frame may differ.
  estimate.status = TrackingStatus::tracking;
  estimate.reason.clear();
  return true;
}

/// Measures the motion from the reference in the left image, else in the right one, where the landmarks stay those of
/// the reference, else from the latest frame, which was lost: where that succeeds it is the reference.
void Odometer::State::measure_from_any(const StereoImages& images, const MotionPrediction& prediction, bool blurred,
                                       MotionEstimate& estimate) {
  estimate.status = TrackingStatus::lost;
  estimate.reason = "the left image is missing";
  if (!images.left.empty()) {
    const MotionMeasurement measured = measure(memory.reference, images, ImageSide::left, prediction, estimate);
    const bool few = measured.fit.inliers < options.motion.min_tracking_inliers,
               is_doubtful = few || measured.ambiguous || !measured.on_object.empty();
    if (!measured.is_lost()) {
      if (!memory.kept.is_kept() && (blurred || is_doubtful)) keep(memory.reference.clone());
      return accept(measured, images, estimate);
    }
    estimate.reason = measured.reason;
    estimate.matches = measured.matches;
    if (measured.untrusted) {
      ++memory.ambiguous_frames;
      return;
    }
  }
  if (!images.right.empty()) {
    right_pyramid.compute(images.right_smooth);
    const MotionMeasurement in_right = measure(memory.reference, images, ImageSide::right, prediction, estimate);
    estimate.keeps_reference = !in_right.is_lost();
    if (!in_right.is_lost()) return accept(in_right, images, estimate);
  }
  if (images.left.empty() || memory.latest.map.landmarks.empty()) return;
  const MotionMeasurement from_latest = measure(memory.latest, images, ImageSide::left,
                                                prediction.from(memory.reference_from_latest.inverse()), estimate);
  if (from_latest.is_lost()) return;
  if (!memory.kept.is_kept()) keep(std::move(memory.reference));
  memory.reference = std::move(memory.latest);
  memory.latest = {};
  accept(from_latest, images, estimate);
  estimate.from = memory.reference.stamp;
}

/// Makes the current frame the reference. Where it is lost the reference stays, and the landmarks of the frame are kept
/// beside it; where it was measured in the right image the reference stays, too.
void Odometer::State::advance(const StereoImages& images, bool usable, bool same_geometry, MotionEstimate& estimate) {
  const bool lost = estimate.status == TrackingStatus::lost, in_right = !lost && estimate.keeps_reference;
  LandmarkFrame& frame = lost || in_right ? memory.latest : memory.reference;
  frame.stamp = estimate.to;
  if (lost || in_right) frame.map = {};
  if (usable) memory.geometry = images.geometry;
  if (usable && !in_right && !images.left.empty()) {
    add_landmarks(images, frame.map, estimate);
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
  if (lost) {
    if (!same_geometry) memory.kept = {};
    if (same_geometry && !memory.kept.is_kept()) keep(std::move(memory.reference));
    memory.reference = std::move(memory.latest);
  }
  memory.frames_since_reference = 0;
  memory.latest = {};
}

/// After a frame: the pose of the kept frame relative to the new reference. It is kept over blurred and doubtful
/// frames, whose landmarks may not be found again, and a few frames longer.
void Odometer::State::follow_kept(const MotionEstimate& estimate, const Sharpness& sharpness, bool blurred) {
  KeptFrame& kept = memory.kept;
  const bool lost = estimate.status == TrackingStatus::lost,
             is_good = !lost && estimate.status != TrackingStatus::degraded && !blurred;
  if ((!lost && !blurred) || kept.age >= kMostKeptFrames) memory.sharpness = sharpness;
  if (is_good) ++kept.searches;
  if (kept.age >= kMostKeptFrames || kept.searches > kMostSearches) kept = {};
  if (!kept.is_kept()) return;
  ++kept.age;
  if (estimate.keeps_reference) return;
  if (estimate.from != kept.reference_stamp) {
    // From the latest frame, which was lost.
    kept.kept_from_reference =
        compose(kept.kept_from_reference,
                {memory.reference_from_latest, covariance_of_prediction(memory.reference_from_latest)});
  }
  kept.kept_from_reference = compose(kept.kept_from_reference, {estimate.previous_from_current, estimate.covariance});
  kept.reference_stamp = estimate.to;
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
  s.tracks.clear();
  Stopwatch all;
  MotionEstimate estimate;
  estimate.to = pair.stamp;
  estimate.first = !s.memory.started;
  estimate.from = s.memory.started ? s.memory.reference.stamp : pair.stamp;
  MotionPrediction prediction = predict_motion(s.memory, s.options.motion, pair.stamp);
  if (predicted) prediction.motion = *predicted;
  if (alternative) prediction.other_starts.insert(prediction.other_starts.begin(), *alternative);

  const std::optional<std::string> defect = s.defect_of(pair);
  StereoImages images{pair.geometry, pair.left, pair.right, {}, {}, pair.left_mask, pair.right_mask, disparity};
  const bool same_geometry = s.memory.geometry == pair.geometry;
  Sharpness sharpness;
  bool blurred = false;
  if (defect) {
    estimate.status = TrackingStatus::lost;
    estimate.reason = *defect;
  } else {
    s.left_smooth.compute(pair.left, s.workers);
    s.right_smooth.compute(pair.right, s.workers);
    images.left_smooth = s.left_smooth.view();
    images.right_smooth = s.right_smooth.view();
    if (!images.left.empty()) s.pyramid.compute(images.left_smooth);
    sharpness = sharpness_of(images.left.empty() ? images.right_smooth : images.left_smooth);
    blurred = is_blurred(sharpness, s.memory.sharpness);
    if (estimate.first) {
      // Nothing to measure against.
    } else if (same_geometry) {
      if (blurred || !s.measure_from_kept(images, prediction, estimate))
        s.measure_from_any(images, prediction, blurred, estimate);
    } else {
      estimate.status = TrackingStatus::lost;
      estimate.reason = "the geometry of the pair has changed";
    }
  }
  if (estimate.status == TrackingStatus::lost && !estimate.first) {
    estimate.previous_from_current = prediction.motion;
    estimate.covariance = covariance_of_prediction(prediction.motion);
  } else if (!estimate.first && !s.keeps_prediction()) {
    s.memory.latest_velocity = {log_se3(estimate.previous_from_current), seconds_between(estimate.from, estimate.to)};
    if (estimate.inliers >= s.options.motion.min_tracking_inliers) s.memory.steady_velocity = s.memory.latest_velocity;
  }
  s.advance(images, !defect, same_geometry, estimate);
  s.follow_kept(estimate, sharpness, blurred);
  s.memory.started = true;
  estimate.landmarks = static_cast<int>(s.memory.reference.map.landmarks.size());
  estimate.times.total = all.lap();
  return estimate;
}

std::span<const LandmarkTrack> Odometer::tracks() const {
  return state_->tracks;
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
