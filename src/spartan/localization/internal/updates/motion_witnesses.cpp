#include "spartan/localization/internal/updates/motion_witnesses.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/internal/updates/inclinometer_update.h"
#include "spartan/localization/internal/updates/motion_plausibility.h"
#include "spartan/localization/internal/updates/wheel_step.h"

namespace spartan::internal {
namespace {

/// The IMU and the wheels agree where they differ by fewer standard deviations, and vision contradicts the IMU where it
/// differs by more.
constexpr double kAgreeSigmas = 3;
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

std::optional<InclinometerSample> tilt_at(const InclinometerMemory& tilt, Stamp stamp) {
  if (!tilt.known || seconds_between(tilt.last.stamp, stamp) > kFreshTilt_s) return std::nullopt;
  return tilt.last;
}

void learn_inclinometer(InclinometerMemory& inclinometer, const MotionEvidence& evidence) {
  if (!evidence.against_inclinometer) return;
  NoiseRatio& noise = inclinometer.of_motions;
  noise.add(0.5 * *evidence.against_inclinometer * std::max(1.0, noise.factor()));
}

MotionWitnesses::MotionWitnesses(const LocalizationOptions& options)
    : white_noise_factor_(options.vision.white_noise_factor),
      wheels_(options.wheels),
      inclinometer_(options.inclinometer),
      wheel_centre_(turning_centre(options)) {}

MotionEvidence MotionWitnesses::evidence_of(const FilterMemory& memory, const VisualMotion& visual,
                                            const Innovation& innovation) const {
  const RelativeMotion& motion = visual.motion;
  const VisionMemory& vision = memory.vision;
  MotionEvidence e;
  e.vision = memory.monitor(LocalizationSensor::vision).state;
  e.imu = memory.monitor(LocalizationSensor::imu).state;
  e.wheels = memory.monitor(LocalizationSensor::wheels).state;
  e.inclinometer = memory.monitor(LocalizationSensor::inclinometer).state;
  e.predicted_by_imu = vision.constant_velocity_s == 0;
  e.against_wheels = compare_with_wheels(memory, visual);
  if (e.predicted_by_imu) {
    e.nis = normalized_innovation_squared(memory.estimate.covariance, innovation);
    e.forward = compare_forward(memory, visual);
  } else {
    e.against_inclinometer = compare_with_inclinometer(memory, visual);
    if (vision.wheels_in_prediction && e.against_wheels)
      e.against_prediction_by_wheels = translation_nis(memory.estimate.covariance, innovation);
  }
  e.follows_doubted = vision.doubted && vision.doubted_at == motion.from;
  e.keeps_reference = motion.keeps_reference;
  e.is_implausible = is_implausible(vision.recent, motion);
  return e;
}

std::optional<double> MotionWitnesses::compare_with_inclinometer(const FilterMemory& memory,
                                                                 const VisualMotion& visual) const {
  const RelativeMotion& motion = visual.motion;
  const std::optional<InclinometerSample> now = tilt_at(memory.inclinometer, motion.to);
  if (!now || !memory.vision.has_tilt) return std::nullopt;
  const InclinometerSample& before = memory.vision.tilt;
  const Eigen::Matrix3d rotation = motion.previous_from_current.rotation().toRotationMatrix();
  const Eigen::Vector3d measured = up_of_roll_pitch(now->roll_rad, now->pitch_rad),
                        seen = rotation.transpose() * up_of_roll_pitch(before.roll_rad, before.pitch_rad);
  const double age = seconds_between(before.stamp, motion.from) + seconds_between(now->stamp, motion.to);
  const double variance = std::pow(stated_sigma(inclinometer_, before), 2) +
                          std::pow(stated_sigma(inclinometer_, *now), 2) + std::pow(kRocking_rad_s * age, 2);
  const Eigen::Vector3d side = seen.unitOrthogonal();
  Eigen::Matrix<double, 2, 3> directions;
  directions << side.transpose(), seen.cross(side).transpose();
  const Eigen::Matrix<double, 2, 3> by_rotation = directions * skew(seen);
  const Eigen::Matrix2d covariance =
      by_rotation * motion.covariance.bottomRightCorner<3, 3>() * by_rotation.transpose() +
      variance * Eigen::Matrix2d::Identity();
  const Eigen::Vector2d residual = directions * (measured - seen);
  return residual.dot(covariance.ldlt().solve(residual)) / std::max(1.0, memory.inclinometer.of_motions.factor());
}

/// The step of the wheels since the last frame.
std::optional<WheelStep> MotionWitnesses::wheel_step_since_frame(const FilterMemory& memory, Stamp stamp) const {
  const std::optional<WheelSample> wheels = wheels_at(memory.wheels, stamp);
  if (!wheels || !memory.vision.has_wheels) return std::nullopt;
  return step_between(memory.vision.wheels, *wheels, wheels_);
}

std::optional<double> MotionWitnesses::compare_with_wheels(const FilterMemory& memory,
                                                           const VisualMotion& visual) const {
  const RelativeMotion& motion = visual.motion;
  const std::optional<WheelStep> step = wheel_step_since_frame(memory, motion.to);
  if (!step) return std::nullopt;
  NavigationState seen;
  seen.world_from_body = motion.previous_from_current;
  seen.wheel_scale = memory.estimate.state.wheel_scale;
  ErrorCovariance p = ErrorCovariance::Zero();
  p.topLeftCorner<6, 6>() = motion.covariance;
  p(error_at::kWheelScale, error_at::kWheelScale) =
      memory.estimate.covariance(error_at::kWheelScale, error_at::kWheelScale);
  return normalized_innovation_squared(p, wheel_innovation(seen, *step, wheel_centre_));
}

std::optional<ForwardComparison> MotionWitnesses::compare_forward(const FilterMemory& memory,
                                                                  const VisualMotion& visual) const {
  const RelativeMotion& motion = visual.motion;
  const std::optional<WheelStep> step = wheel_step_since_frame(memory, motion.to);
  if (!step || memory.vision.wheels_in_prediction ||
      memory.monitor(LocalizationSensor::wheels).state == SensorState::excluded)
    return std::nullopt;
  const NavigationState& s = memory.estimate.state;
  const ErrorCovariance& p = memory.estimate.covariance;
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
      white_noise_factor_ * motion.own_covariance() +
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
