#include "spartan/odometry/internal/motion_prediction.h"

#include <algorithm>
#include <cmath>

namespace spartan::internal {
namespace {

/// Over a gap between stamps the latest motion is extrapolated to at most this many times its duration.
constexpr double kMostSpans = 2;
/// Standard deviations of a motion that was not measured, beside the predicted one: larger than any motion between two
/// frames of a rover.
constexpr double kLostTranslation_m = 1.0, kLostRotation_rad = 0.5;

/// Prior of the disparity offset for the current frame: a random walk, bounded by the prior of the calibration.
DisparityOffset predict_offset(const DisparityOffset& offset, const MotionEstimationOptions& options) {
  const double sigma = options.offset_sigma_px, drift = options.offset_drift_px;
  if (!(sigma > 0)) return {};
  if (!(offset.variance > 0)) return {0, sigma * sigma};
  return {offset.value, std::min(offset.variance + drift * drift, sigma * sigma)};
}

}  // namespace

MotionPrediction MotionPrediction::from(const Pose& other_from_previous) const {
  MotionPrediction result = *this;
  result.motion = other_from_previous * motion;
  for (Pose& start : result.other_starts) start = other_from_previous * start;
  return result;
}

MotionPrediction predict_motion(const OdometerMemory& memory, const MotionEstimationOptions& options, Stamp now) {
  const bool is_reference = memory.frames_since_reference == 0;
  const Pose reference_from_latest = is_reference ? Pose() : memory.reference_from_latest;
  const double elapsed_s = seconds_between(is_reference ? memory.reference.stamp : memory.latest.stamp, now);
  const MeasuredVelocity &latest = memory.latest_velocity, &steady = memory.steady_velocity;
  MotionPrediction prediction;
  prediction.motion = reference_from_latest;
  prediction.from_measured_motion = latest.is_known();
  prediction.offset = predict_offset(memory.offset, options);
  if (!latest.is_known() || !(elapsed_s > 0)) return prediction;
  const double spans = elapsed_s / latest.span_s;
  prediction.over_gap = spans > kMostSpans;
  const auto moved = [&](const Vector6d& motion) { return reference_from_latest * exp_se3(motion); };
  prediction.motion = moved(latest.motion * std::min(spans, kMostSpans));
  // A rover that moves in steps moves on by one step, however long it has stopped; another one has driven on.
  prediction.other_starts.push_back(moved(latest.motion));
  if (prediction.over_gap) prediction.other_starts.push_back(moved(latest.motion * spans));
  if (steady.is_known() && steady.motion != latest.motion)
    prediction.other_starts.push_back(moved(steady.motion * (elapsed_s / steady.span_s)));
  return prediction;
}

Matrix6d covariance_of_prediction(const Pose& motion) {
  const double translation = std::hypot(kLostTranslation_m, motion.translation().norm()),
               rotation = std::hypot(kLostRotation_rad, rotation_angle(motion));
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(translation * translation), Eigen::Vector3d::Constant(rotation * rotation);
  return variances.asDiagonal();
}

}  // namespace spartan::internal
