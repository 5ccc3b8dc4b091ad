// What the other sensors, and the motions before, say about a visual motion.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "spartan/localization/internal/error_state_filter.h"
#include "spartan/localization/internal/kalman_update.h"
#include "spartan/localization/internal/measurement_models.h"

namespace spartan::internal {
namespace {

/// The IMU and the wheels agree where they differ by fewer standard deviations, and vision contradicts the IMU where it
/// differs by more.
constexpr double kAgreeSigmas = 3;
/// A motion is implausible where it differs from all that a speed between zero and the last one can explain by more
/// than this multiple of the recent length (a reversal: twice) and this length. The length fades by kLengthFades with
/// each motion; it is known after kRecentMotions.
constexpr double kImplausibleFactor = 2, kImplausible_m = 0.1, kLengthFades = 0.9;
constexpr std::uint32_t kRecentMotions = 3;
/// Maximum age of a reading of the inclinometer at a frame; angular rate of a rocking rover in the time between.
constexpr double kFreshTilt_s = 0.5, kRocking_rad_s = 0.03;

double translation_nis(const ErrorCovariance& covariance, const Innovation& innovation) {
  Innovation shift(3);
  shift.residual = innovation.residual.head<3>();
  shift.jacobian = innovation.jacobian.topRows<3>();
  shift.noise = innovation.noise.topLeftCorner<3, 3>();
  return normalized_innovation_squared(covariance, shift);
}

}  // namespace

MotionEvidence ErrorStateFilter::evidence_of(const VisualMotion& visual, const Innovation& innovation) const {
  const RelativeMotion& motion = visual.motion;
  const VisionMemory& vision = memory_.vision;
  MotionEvidence e;
  e.vision = memory_.monitor(LocalizationSensor::vision).state;
  e.imu = memory_.monitor(LocalizationSensor::imu).state;
  e.wheels = memory_.monitor(LocalizationSensor::wheels).state;
  e.inclinometer = memory_.monitor(LocalizationSensor::inclinometer).state;
  e.predicted_by_imu = vision.constant_velocity_s == 0;
  e.against_wheels = compare_with_wheels(visual);
  if (e.predicted_by_imu) {
    e.nis = normalized_innovation_squared(memory_.estimate.covariance, innovation);
    e.forward = compare_forward(visual);
  } else {
    e.against_inclinometer = compare_with_inclinometer(visual);
    if (vision.wheels_in_prediction && e.against_wheels)
      e.against_prediction_by_wheels = translation_nis(memory_.estimate.covariance, innovation);
  }
  e.follows_doubted = vision.doubted && vision.doubted_at == motion.from;
  e.keeps_reference = motion.keeps_reference;
  e.is_implausible = is_implausible(motion);
  return e;
}

/// While the cameras stand, or show the same frame, the rover may have moved on.
bool ErrorStateFilter::is_implausible(const RelativeMotion& motion) const {
  const RecentMotion& recent = memory_.vision.recent;
  if (recent.count < kRecentMotions || motion.is_stationary()) return false;
  const double seconds = seconds_between(std::min(recent.end, motion.from), motion.to);
  const Eigen::Vector3d way = recent.velocity_m_s * seconds, moved = motion.previous_from_current.translation();
  const double part = std::clamp(moved.dot(way) / std::max(way.squaredNorm(), 1e-12), 0.0, 1.0);
  return (moved - part * way).norm() > kImplausibleFactor * recent.length_m + kImplausible_m;
}

/// Of a motion that was used. The length of an uncertain one counts as far as it was plausible.
void ErrorStateFilter::remember_motion(const RelativeMotion& motion, bool uncertain) {
  if (motion.is_stationary()) return;
  RecentMotion& recent = memory_.vision.recent;
  const Pose& moved = motion.previous_from_current;
  double length = moved.translation().norm();
  if (uncertain) length = std::min(length, kImplausibleFactor * recent.length_m + kImplausible_m);
  recent.length_m = std::max(kLengthFades * recent.length_m, length);
  recent.count = std::min(recent.count + 1, kRecentMotions);
  recent.velocity_m_s = length / std::max(seconds_between(motion.from, motion.to), 1e-3) *
                        (moved.rotation().conjugate() * moved.translation().stableNormalized());
  recent.end = motion.to;
}

/// The last reading before a frame.
std::optional<InclinometerSample> ErrorStateFilter::tilt_at(Stamp stamp) const {
  const InclinometerMemory& tilt = memory_.inclinometer;
  if (!tilt.known || seconds_between(tilt.last.stamp, stamp) > kFreshTilt_s) return std::nullopt;
  return tilt.last;
}

/// NIS of the direction of up at the end of the visual motion against the readings at both ends; their bias cancels. A
/// rover that rocks differs more from the readings, which come before the frames: their noise is measured.
std::optional<double> ErrorStateFilter::compare_with_inclinometer(const VisualMotion& visual) const {
  const RelativeMotion& motion = visual.motion;
  const std::optional<InclinometerSample> now = tilt_at(motion.to);
  if (!now || !memory_.vision.has_tilt) return std::nullopt;
  const InclinometerSample& before = memory_.vision.tilt;
  const Eigen::Matrix3d rotation = motion.previous_from_current.rotation().toRotationMatrix();
  const Eigen::Vector3d measured = up_of_roll_pitch(now->roll_rad, now->pitch_rad),
                        seen = rotation.transpose() * up_of_roll_pitch(before.roll_rad, before.pitch_rad);
  const double age = seconds_between(before.stamp, motion.from) + seconds_between(now->stamp, motion.to);
  const double variance =
      std::pow(stated_sigma(before), 2) + std::pow(stated_sigma(*now), 2) + std::pow(kRocking_rad_s * age, 2);
  const Eigen::Vector3d side = seen.unitOrthogonal();
  Eigen::Matrix<double, 2, 3> directions;
  directions << side.transpose(), seen.cross(side).transpose();
  const Eigen::Matrix<double, 2, 3> by_rotation = directions * skew(seen);
  const Eigen::Matrix2d covariance =
      by_rotation * motion.covariance.bottomRightCorner<3, 3>() * by_rotation.transpose() +
      variance * Eigen::Matrix2d::Identity();
  const Eigen::Vector2d residual = directions * (measured - seen);
  return residual.dot(covariance.ldlt().solve(residual)) / std::max(1.0, memory_.inclinometer.of_motions.factor());
}

void ErrorStateFilter::learn_inclinometer(const MotionEvidence& evidence) {
  if (!evidence.against_inclinometer) return;
  NoiseRatio& noise = memory_.inclinometer.of_motions;
  noise.add(0.5 * *evidence.against_inclinometer * std::max(1.0, noise.factor()));
}

/// The step of the wheels since the last frame. None if they cannot tell.
std::optional<WheelStep> ErrorStateFilter::wheel_step_since_frame(Stamp stamp) const {
  const std::optional<WheelSample> wheels = wheels_at(stamp);
  if (!wheels || !memory_.vision.has_wheels) return std::nullopt;
  return step_between(memory_.vision.wheels, *wheels);
}

/// NIS of the visual motion against the count of the wheels since the last frame, if they can tell.
std::optional<double> ErrorStateFilter::compare_with_wheels(const VisualMotion& visual) const {
  const RelativeMotion& motion = visual.motion;
  const std::optional<WheelStep> step = wheel_step_since_frame(motion.to);
  if (!step) return std::nullopt;
  NavigationState seen;
  seen.world_from_body = motion.previous_from_current;
  seen.wheel_scale = memory_.estimate.state.wheel_scale;
  ErrorCovariance p = ErrorCovariance::Zero();
  p.topLeftCorner<6, 6>() = motion.covariance;
  p(error_at::kWheelScale, error_at::kWheelScale) =
      memory_.estimate.covariance(error_at::kWheelScale, error_at::kWheelScale);
  return normalized_innovation_squared(p, wheel_innovation(seen, *step, wheel_centre_));
}

/// Distance along the body's x since the last frame, by the wheels, by the IMU and by vision. A repeating texture
/// shifts a visual motion by its period, with a small covariance. None if the wheels cannot tell.
std::optional<ForwardComparison> ErrorStateFilter::compare_forward(const VisualMotion& visual) const {
  const RelativeMotion& motion = visual.motion;
  const std::optional<WheelStep> step = wheel_step_since_frame(motion.to);
  if (!step || memory_.vision.wheels_in_prediction ||
      memory_.monitor(LocalizationSensor::wheels).state == SensorState::excluded)
    return std::nullopt;
  const NavigationState& s = memory_.estimate.state;
  const ErrorCovariance& p = memory_.estimate.covariance;
  const double counted_m = s.wheel_scale * step->counted_m;
  const double counted_variance = std::pow(step->forward_sigma_m, 2) +
                                  p(error_at::kWheelScale, error_at::kWheelScale) * step->counted_m * step->counted_m;
  const StepForward predicted = forward_since(s, error_at::kVisionClone, wheel_centre_);
  const double predicted_variance = predicted.jacobian * p * predicted.jacobian.transpose();
  // As in relative_motion_innovation(): white noise, and the errors that last.
  const Pose to_centre = Pose::from_translation(wheel_centre_);
  const double seen_m = forward_of(to_centre.inverse() * motion.previous_from_current *
                                   exp_se3(lasting_error(s, visual.errors)) * to_centre);
  Eigen::Matrix<double, 6, 20> by_lasting;  // z₁, z₂, η
  static_assert(error_at::kVisionConstant == error_at::kVisionDrift + 6 &&
                error_at::kCalibration == error_at::kVisionDrift + 12);
  by_lasting << visual.errors.drift, visual.errors.drift, visual.errors.by_calibration;
  const Eigen::Matrix<double, 1, 6> along = adjoint(to_centre.inverse()).row(0);
  const Matrix6d seen_covariance =
      options_.vision.white_noise_factor * motion.own_covariance() +
      by_lasting * p.block<20, 20>(error_at::kVisionDrift, error_at::kVisionDrift) * by_lasting.transpose();
  const double seen_variance = along * seen_covariance * along.transpose();

  const auto square = [](double v) { return v * v; };
  const double weights = 1 / counted_variance + 1 / predicted_variance;
  const double mean_m = (counted_m / counted_variance + predicted.metres / predicted_variance) / weights;
  ForwardComparison result;
  result.imu_and_wheels_agree =
      square(counted_m - predicted.metres) <= square(kAgreeSigmas) * (counted_variance + predicted_variance);
  result.vision_contradicts_imu =
      square(seen_m - predicted.metres) > square(kAgreeSigmas) * (predicted_variance + seen_variance);
  result.vision_nis = square(seen_m - mean_m) / (1 / weights + seen_variance);
  return result;
}

}  // namespace spartan::internal
