// Motions between shots.
#include <Eigen/Dense>
#include <cmath>

#include "spartan/localization/internal/error_state_filter.h"
#include "spartan/localization/internal/kalman_update.h"
#include "spartan/localization/internal/measurement_models.h"

namespace spartan {
namespace {

/// Where vision measures, the noise of a prediction without an IMU counts (1 + this) times: the prediction is then
/// worth nothing, and the filter composes the motions as they come.
constexpr double kUnmeasuredFactor = 99;
/// Where vision overrules the prediction, its error is taken to be so many times what was found.
constexpr double kOverruledFactor = 10;
/// Even what stays for a drive is forgotten after so many shots, so that the filter never gets too sure of it.
constexpr double kConstantSteps = 5000;
constexpr double kLeastVariance = 1e-14;

Matrix6d usable_covariance(const Matrix6d& stated, double factor) {
  Matrix6d r = 0.5 * factor * (stated + stated.transpose());
  r.diagonal().array() += kLeastVariance;
  return r;
}

// Position, attitude, velocity stand first among the errors.
static_assert(error_at::kPosition == 0 && error_at::kAttitude == 3 && error_at::kVelocity == 6);

}  // namespace

void ErrorStateFilter::take(const RelativeMotion& motion) {
  move_to(motion.to, nullptr);
  SensorJudge& judge = memory_.judge(LocalizationSensor::vision);
  const bool joins = motion.from == memory_.vision.clone_stamp;
  if (!motion.measured || !joins) {
    if (judge.state != SensorState::excluded) judge.state = SensorState::suspect;
    judge.reason = HealthReason::lost;
    ++judge.rejected;
    memory_.vision.stood = false;
  } else {
    compare_gyro(motion);
    if (measure_motion(motion)) {
      const NavigationState& s = memory_.belief.state;
      const double seconds = seconds_between(motion.from, motion.to);
      memory_.vision.rate_rad_s =
          log_so3(motion_since_clone(s, error_at::kVisionClone).clone_from_body.rotation()) / seconds;
    }
  }
  end_step_at_shot(motion.to);
  begin_shot(motion.to);
}

/// Whether the motion was used.
bool ErrorStateFilter::measure_motion(const RelativeMotion& motion) {
  VisionMemory& vision = memory_.vision;
  ErrorCovariance& p = memory_.belief.covariance;
  const Pose& measured = motion.previous_from_current;
  vision.stood = measured.translation().isZero(1e-12) && measured.rotation().vec().isZero(1e-12);

  if (!vision.stood) {
    let_drift(error_at::kVisionDrift, drift_sigmas_, options_.vision.drift_steps);
    let_drift(error_at::kVisionConstant, constant_sigmas_, kConstantSteps);
  }

  const bool predicted = vision.unmeasured_s == 0;
  p.topLeftCorner<9, 9>() += kUnmeasuredFactor * vision.unmeasured_noise;

  const Matrix6d covariance = usable_covariance(motion.covariance, options_.vision.white_factor);
  const Vector6d drift = vision.stood ? Vector6d::Zero().eval() : motion.covariance.diagonal().cwiseSqrt().eval();
  const Innovation innovation =
      relative_motion_innovation(memory_.belief.state, error_at::kVisionClone, measured, covariance, drift);
  const double square = predicted ? normalised_square(p, innovation) : 0;
  SensorJudge& judge = memory_.judge(LocalizationSensor::vision);
  const bool confirmed = square > vision_gate_ && wheels_confirm_prediction(motion);
  if (square > vision_gate_ && !confirmed) return overrule_prediction(innovation, square, motion);
  if (!judge.judge(square, vision_gate_, HealthReason::disagrees, options_.health.excluded_after,
                   options_.health.back_after))
    return false;
  SensorJudge& imu = memory_.judge(LocalizationSensor::imu);
  if (predicted && imu.state == SensorState::suspect) imu.readmit();  // it said what vision saw
  correct_motion(innovation, error_at::kVisionClone);
  return true;
}

/// One step of a Gauss-Markov process.
void ErrorStateFilter::let_drift(int index, const Vector6d& sigmas, double steps) {
  const double stays = std::exp(-1 / steps);
  NavigationState& s = memory_.belief.state;
  ErrorCovariance& p = memory_.belief.covariance;
  (index == error_at::kVisionDrift ? s.vision_drift : s.vision_constant) *= stays;
  p.middleRows<6>(index) *= stays;
  p.middleCols<6>(index) *= stays;
  p.diagonal().segment<6>(index) += (1 - stays * stays) * sigmas.cwiseAbs2();
}

/// Vision and prediction differ, and nothing speaks for the prediction: it is forgotten, along with the motion since
/// the last shot, and the IMU answers for it.
bool ErrorStateFilter::overrule_prediction(const Innovation& innovation, double square, const RelativeMotion& motion) {
  const double seconds = std::max(seconds_between(motion.from, motion.to), 1e-3);
  const double shift = kOverruledFactor * innovation.residual.head<3>().norm(),
               turn = kOverruledFactor * innovation.residual.tail<3>().norm();
  const SteadyNoise noise{(shift + 1e-3) * std::sqrt(3 / (seconds * seconds * seconds)),
                          (turn + 1e-4) / std::sqrt(seconds)};
  const SteadyStep step{Eigen::Vector3d::Zero(), seconds};
  memory_.belief.covariance.topLeftCorner<9, 9>() +=
      transition(memory_.belief.state, step, noise).noise.topLeftCorner<9, 9>();
  memory_.step.standing = false;
  memory_.judge(LocalizationSensor::imu)
      .judge(square, vision_gate_, HealthReason::overruled, options_.health.excluded_after, options_.health.back_after);
  memory_.judge(LocalizationSensor::vision)
      .judge(0, vision_gate_, HealthReason::none, options_.health.excluded_after, options_.health.back_after);
  correct_motion(innovation, error_at::kVisionClone);
  return true;
}

/// Wheels that agree with the prediction and not with vision: two against one.
bool ErrorStateFilter::wheels_confirm_prediction(const RelativeMotion& motion) const {
  const std::optional<WheelSample> wheels = wheels_at(motion.to);
  if (!wheels || !memory_.step.has_wheels || memory_.step.from != motion.from) return false;
  if (memory_.judge(LocalizationSensor::wheels).state != SensorState::ok) return false;
  const WheelStep step = step_to(*wheels);
  const double counted = memory_.belief.state.wheel_scale * step.counted_m;
  const double sigma =
      std::hypot(step.forward_sigma_m,
                 std::sqrt(memory_.belief.covariance(error_at::kWheelScale, error_at::kWheelScale)) * step.counted_m);
  const double predicted = forward_of_step(memory_.belief.state).metres;
  return std::abs(counted - predicted) < 3 * sigma &&
         std::abs(counted - motion.previous_from_current.translation().x()) > 5 * sigma;
}

/// An IMU that was overruled comes back when its gyro turns as vision does.
void ErrorStateFilter::compare_gyro(const RelativeMotion& motion) {
  InertialMemory& imu = memory_.imu;
  SensorJudge& judge = memory_.judge(LocalizationSensor::imu);
  if (judge.state != SensorState::excluded || judge.reason != HealthReason::overruled) return;
  if (!imu.turn_whole || !(imu.turn_s > 0)) return;
  const Eigen::Quaterniond seen = motion.previous_from_current.rotation();
  const double off = log_so3(imu.turn.conjugate() * seen).norm(), angle = log_so3(seen).norm();
  const double variance = std::pow(options_.imu.gyro_noise_rad_s_sqrt_hz, 2) * imu.turn_s +
                          std::pow(2 * options_.imu.gyro_bias_rad_s * imu.turn_s, 2) +
                          motion.covariance.diagonal().tail<3>().maxCoeff() + std::pow(0.01 * angle, 2);
  if (off * off > 16 * variance) {
    judge.passed_in_row = 0;
    return;
  }
  if (++judge.passed_in_row < options_.health.back_after) return;
  judge.readmit();
  ErrorCovariance& p = memory_.belief.covariance;
  p.middleRows<6>(error_at::kGyroBias).setZero();
  p.middleCols<6>(error_at::kGyroBias).setZero();
  p.diagonal().segment<3>(error_at::kGyroBias).setConstant(std::pow(options_.imu.gyro_bias_rad_s, 2));
  p.diagonal().segment<3>(error_at::kAccelBias).setConstant(std::pow(options_.imu.accel_bias_m_s2, 2));
}

/// The next motion will be measured from here.
void ErrorStateFilter::begin_shot(Stamp stamp) {
  const UncertainPose odom = odom_from_body();
  memory_.vision.odom_from_clone = odom.pose;
  memory_.vision.odom_covariance = odom.covariance;
  memory_.vision.clone_stamp = stamp;
  memory_.vision.unmeasured_noise.setZero();
  memory_.vision.unmeasured_s = 0;
  memory_.imu.turn.setIdentity();
  memory_.imu.turn_s = 0;
  memory_.imu.turn_whole = memory_.imu.known;
  clone_pose(memory_.belief, error_at::kVisionClone);
}

}  // namespace spartan
