#include "spartan/localization/internal/error_state_filter.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "spartan/localization/internal/chi_square.h"
#include "spartan/localization/internal/kalman_update.h"
#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/start_frame.h"

namespace spartan {
namespace {

constexpr double kLargestRate_rad_s = 35, kLargestForce_m_s2 = 300;
/// Of what defines the world: only so large that nothing divides by zero.
constexpr double kExact = 1e-6;
constexpr double kUnknownSpeed_m_s = 20, kRestingSpeed_m_s = 0.01;
constexpr double kLevelledTilt_rad = 0.2, kUnknownTilt_rad = 0.35, kUnknownHeading_rad = 10;
/// How much a rover accelerates on the mean of a second while its IMU finds gravity.
constexpr double kLevelError_m_s2 = 0.1;
constexpr double kLongestStep_s = 60;

void set_variance(ErrorCovariance& p, int at, int size, double sigma) {
  p.diagonal().segment(at, size).setConstant(sigma * sigma);
}

Vector6d six_of(const std::vector<double>& values) {
  if (values.size() != 6) throw std::invalid_argument("ErrorStateFilter: a list of drift sigmas must have 6 numbers");
  return Eigen::Map<const Vector6d>(values.data());
}

template <class T>
std::vector<T> only(std::span<const Measurement> all) {
  std::vector<T> some;
  for (const Measurement& m : all) {
    if (const T* value = std::get_if<T>(&m)) some.push_back(*value);
  }
  return some;
}

ImuSample between(const ImuSample& a, const ImuSample& b, Stamp at) {
  const double whole = seconds_between(a.stamp, b.stamp);
  const double part = whole > 0 ? std::clamp(seconds_between(a.stamp, at) / whole, 0.0, 1.0) : 1.0;
  return {at, a.gyro_rad_s + part * (b.gyro_rad_s - a.gyro_rad_s), a.accel_m_s2 + part * (b.accel_m_s2 - a.accel_m_s2)};
}

}  // namespace

ErrorStateFilter::ErrorStateFilter(const LocalizationOptions& options) : options_(options) {
  drift_sigmas_ = six_of(options.vision.drift_sigmas);
  constant_sigmas_ = six_of(options.vision.constant_sigmas);
  for (int rows = 1; rows <= 6; ++rows)
    gates_[static_cast<std::size_t>(rows)] = chi_square_quantile(options.health.gate_probability, rows);
  vision_gate_ = chi_square_quantile(options.vision.gate_probability, 6);
}

void ErrorStateFilter::start(Stamp stamp, const Eigen::Vector3d& ahead_in_body, std::span<const Measurement> before,
                             const std::optional<Eigen::Vector3d>& up_in_body) {
  const auto imu = only<ImuSample>(before);
  const auto wheels = only<WheelSample>(before);
  const auto rest = static_reading(imu, options_);
  const auto tilt = median_tilt(only<InclinometerSample>(before), options_.inclinometer.least_sigma_rad);
  const auto heading = agreed_heading(only<CompassSample>(before), options_.compass.least_sigma_rad);
  const Eigen::Vector3d up = rest   ? rest->accel_m_s2.normalized()
                             : tilt ? up_of_roll_pitch(tilt->roll_rad, tilt->pitch_rad)
                                    : up_in_body.value_or(Eigen::Vector3d::UnitZ());

  FilterMemory m;
  m.started = true;
  m.stamp = stamp;
  m.imu.levelled = rest || tilt;  // what came from elsewhere is good to say where up is, not to integrate by
  m.gravity_measured = m.imu.levelled || up_in_body;
  m.compass.heading_east = m.compass.offset_known = heading.has_value();
  NavigationState& s = m.belief.state;
  s.world_from_body = first_pose(up, ahead_in_body, 0);
  if (heading) s.world_from_body = first_pose(up, ahead_in_body, heading->radians - heading_of(s.world_from_body));

  ErrorCovariance& p = m.belief.covariance;
  set_variance(p, error_at::kPose, 6, kExact);
  set_variance(p, error_at::kVelocity, 3, rest && rest->still ? kRestingSpeed_m_s : kUnknownSpeed_m_s);
  set_variance(p, error_at::kGyroBias, 3, std::max(options_.imu.gyro_bias_rad_s, 1e-9));
  set_variance(p, error_at::kAccelBias, 3, std::max(options_.imu.accel_bias_m_s2, 1e-9));
  set_variance(p, error_at::kGravityTilt, 2, m.imu.levelled ? kLevelledTilt_rad : kUnknownTilt_rad);
  set_variance(p, error_at::kWheelScale, 1, std::max(options_.wheels.scale_sigma, 1e-6));
  set_variance(p, error_at::kCompassOffset, 1,
               heading ? std::hypot(heading->sigma_rad, options_.compass.offset_sigma_rad) : kUnknownHeading_rad);
  set_variance(p, error_at::kInclinometerBias, 2, std::max(options_.inclinometer.bias_rad, 1e-9));
  p.diagonal().segment<6>(error_at::kVisionDrift) = drift_sigmas_.cwiseAbs2().cwiseMax(1e-12);
  p.diagonal().segment<6>(error_at::kVisionConstant) = constant_sigmas_.cwiseAbs2().cwiseMax(1e-12);

  // What the means say of tilt and biases; the pose defines the world and stays.
  if (rest) {
    correct(m.belief, rest_innovation(s, rest->accel_m_s2, rest->accel_sigma_m_s2, options_.gravity_m_s2));
    if (rest->still) {
      Innovation bias(3);
      bias.residual = rest->gyro_rad_s - s.gyro_bias_rad_s;
      bias.jacobian.middleCols<3>(error_at::kGyroBias).setIdentity();
      bias.noise.diagonal().setConstant(rest->gyro_sigma_rad_s * rest->gyro_sigma_rad_s);
      correct(m.belief, bias);
    }
  }
  if (tilt) correct(m.belief, inclinometer_innovation(s, tilt->roll_rad, tilt->pitch_rad, tilt->sigma_rad));

  clone_pose(m.belief, error_at::kVisionClone);
  clone_pose(m.belief, error_at::kStepClone);
  m.world_from_odom = Pose();
  m.vision.clone_stamp = m.step.from = stamp;
  m.vision.odom_from_clone = m.step.odom_from_clone = s.world_from_body;
  for (const Measurement& sample : before) m.judge(sensor_of(sample)).see(stamp_of_measurement(sample));
  m.judge(LocalizationSensor::vision).see(stamp);
  if (!imu.empty()) {
    m.imu.known = m.imu.turn_whole = true;
    m.imu.last = imu.back();
    m.imu.changed = m.imu.block.from = m.imu.level_from = imu.back().stamp;
  }
  if (!wheels.empty()) {
    m.wheels.known = true;
    m.wheels.last = m.wheels.previous = wheels.back();
    m.wheels.moved = *std::find_if(wheels.begin(), wheels.end(), [&](const WheelSample& w) {
      return std::abs(w.left_m - wheels.back().left_m) <= options_.standing.wheels_still_m &&
             std::abs(w.right_m - wheels.back().right_m) <= options_.standing.wheels_still_m;
    });
    m.step.has_wheels = seconds_between(wheels.back().stamp, stamp) < options_.health.wheels_timeout_s;
    m.step.wheels = wheels.back();
  }
  memory_ = m;
}

void ErrorStateFilter::process(const Measurement& measurement) {
  memory_.judge(sensor_of(measurement)).see(stamp_of_measurement(measurement));
  std::visit([this](const auto& value) { take(value); }, measurement);
}

bool ErrorStateFilter::inertial_usable() const {
  return memory_.imu.known && memory_.imu.levelled &&
         memory_.judge(LocalizationSensor::imu).state != SensorState::excluded;
}

// With an IMU sample at the end of the step both ends are known; else the last reading is held for a while.
void ErrorStateFilter::move_to(Stamp stamp, const ImuSample* reached) {
  const double seconds = seconds_between(memory_.stamp, stamp);
  if (!(seconds > 0)) return;
  const ImuSample& last = memory_.imu.last;
  if (inertial_usable() && seconds_between(last.stamp, stamp) <= options_.imu.timeout_s) {
    if (reached != nullptr) {
      move_inertially(seconds, between(last, *reached, memory_.stamp), *reached);
    } else {
      move_inertially(seconds, last, last);
    }
  } else {
    move_steadily(std::min(seconds, kLongestStep_s));
  }
  walk_biases(seconds);
  memory_.stamp = stamp;
}

void ErrorStateFilter::move_inertially(double seconds, const ImuSample& from, const ImuSample& to) {
  const InertialStep step{from.gyro_rad_s, to.gyro_rad_s, from.accel_m_s2, to.accel_m_s2, seconds};
  const InertialNoise noise{options_.imu.gyro_noise_rad_s_sqrt_hz, options_.imu.accel_noise_m_s2_sqrt_hz,
                            options_.imu.gyro_walk_rad_s2_sqrt_hz, options_.imu.accel_walk_m_s3_sqrt_hz};
  move_on(memory_.belief.covariance, transition(memory_.belief.state, step, noise, options_.gravity_m_s2));
  memory_.belief.state = propagate(memory_.belief.state, step, options_.gravity_m_s2);
}

void ErrorStateFilter::move_steadily(double seconds) {
  const UnmeasuredMotionOptions& o = options_.unmeasured;
  VisionMemory& vision = memory_.vision;
  const SteadyStep step{vision.rate_rad_s, seconds};
  const double speed = memory_.belief.state.velocity_m_s.norm(), rate = vision.rate_rad_s.norm();
  // A rover that rocks leaves its last rate slowly: the attitude is off by σ t, and (t + dt)² − t² = (2 t + dt) dt.
  const double turn = o.turn_share * (rate + o.turn_floor_rad_s) * std::sqrt(2 * vision.unmeasured_s + seconds);
  const SteadyNoise noise{o.speed_share_sqrt_hz * (speed + o.speed_floor_m_s), turn};
  const Transition t = transition(memory_.belief.state, step, noise);
  const Matrix9d by = t.by_moving.topLeftCorner<9, 9>();
  vision.unmeasured_noise = (by * vision.unmeasured_noise * by.transpose()).eval() + t.noise.topLeftCorner<9, 9>();
  vision.unmeasured_s += seconds;
  move_on(memory_.belief.covariance, t);
  memory_.belief.state = propagate(memory_.belief.state, step);
}

void ErrorStateFilter::walk_biases(double seconds) {
  ErrorCovariance& p = memory_.belief.covariance;
  const auto square = [](double x) { return x * x; };
  if (p(error_at::kWheelScale, error_at::kWheelScale) < square(options_.wheels.scale_sigma))
    p(error_at::kWheelScale, error_at::kWheelScale) += square(options_.wheels.scale_walk_sqrt_hz) * seconds;
  p(error_at::kCompassOffset, error_at::kCompassOffset) += square(options_.compass.offset_walk_rad_sqrt_hz) * seconds;
  p.diagonal().segment<2>(error_at::kInclinometerBias).array() +=
      square(options_.inclinometer.bias_walk_rad_sqrt_hz) * seconds;
}

void ErrorStateFilter::take(const ImuSample& sample) {
  judge_reading(sample);
  turn_by_gyro(sample);
  move_to(sample.stamp, &sample);
  if (inertial_usable()) ++memory_.judge(LocalizationSensor::imu).used;
  InertialMemory& imu = memory_.imu;
  if (!imu.known) {
    imu.known = true;
    imu.changed = imu.block.from = imu.level_from = sample.stamp;
  }
  imu.last = sample;
  if (!imu.levelled) find_level(sample);
  watch_stillness(sample);
}

/// Readings that no rover can have, or that do not change, exclude the IMU; others bring it back.
void ErrorStateFilter::judge_reading(const ImuSample& sample) {
  SensorJudge& judge = memory_.judge(LocalizationSensor::imu);
  InertialMemory& imu = memory_.imu;
  const bool same = imu.known && imu.last.gyro_rad_s == sample.gyro_rad_s && imu.last.accel_m_s2 == sample.accel_m_s2;
  if (!same) imu.changed = sample.stamp;
  const bool possible = sample.gyro_rad_s.cwiseAbs().maxCoeff() < kLargestRate_rad_s &&
                        sample.accel_m_s2.cwiseAbs().maxCoeff() < kLargestForce_m_s2;
  const bool frozen = same && seconds_between(imu.changed, sample.stamp) >= options_.imu.frozen_s;
  if (!possible || frozen) {
    ++judge.rejected;
    judge.exclude(possible ? HealthReason::frozen : HealthReason::out_of_range);
  } else if (judge.state == SensorState::excluded && judge.reason != HealthReason::overruled && !same) {
    if (++judge.passed_in_row >= options_.health.back_after) judge.readmit();
  }
}

void ErrorStateFilter::turn_by_gyro(const ImuSample& sample) {
  InertialMemory& imu = memory_.imu;
  if (!imu.known) return;
  const Stamp from = std::max(imu.last.stamp, memory_.vision.clone_stamp);
  const double seconds = seconds_between(from, sample.stamp);
  if (seconds_between(imu.last.stamp, sample.stamp) > options_.imu.timeout_s) imu.turn_whole = false;
  if (!(seconds > 0)) return;
  const Eigen::Vector3d rate = 0.5 * (imu.last.gyro_rad_s + sample.gyro_rad_s) - memory_.belief.state.gyro_bias_rad_s;
  imu.turn = (imu.turn * exp_so3(rate * seconds)).normalized();
  imu.turn_s += seconds;
}

/// An IMU that starts during the drive: the mean force over a while points up, but for a rover's accelerations.
void ErrorStateFilter::find_level(const ImuSample& sample) {
  InertialMemory& imu = memory_.imu;
  NavigationState& s = memory_.belief.state;
  imu.level_force += s.world_from_body.rotation() * sample.accel_m_s2;
  ++imu.level_count;
  if (seconds_between(imu.level_from, sample.stamp) < options_.imu.level_after_s) return;
  const Eigen::Vector3d mean = imu.level_force / imu.level_count;
  imu.level_from = sample.stamp;
  imu.level_force.setZero();
  imu.level_count = 0;
  SensorJudge& judge = memory_.judge(LocalizationSensor::imu);
  if (std::abs(mean.norm() - options_.gravity_m_s2) > 0.05 * options_.gravity_m_s2 || mean.z() <= 0) {
    judge.state = SensorState::suspect;
    judge.reason = HealthReason::out_of_range;
    return;
  }
  s.gravity_tilt_rad = tilt_of_up(mean);
  correct_world(
      rest_innovation(s, s.world_from_body.rotation().conjugate() * mean, kLevelError_m_s2, options_.gravity_m_s2));
  imu.levelled = true;
  judge.readmit();
}

void ErrorStateFilter::watch_stillness(const ImuSample& sample) {
  StillnessBlock& b = memory_.imu.block;
  b.gyro += sample.gyro_rad_s;
  b.accel += sample.accel_m_s2;
  b.gyro_squares += sample.gyro_rad_s.cwiseAbs2();
  b.accel_squares += sample.accel_m_s2.cwiseAbs2();
  ++b.count;
  if (seconds_between(b.from, sample.stamp) < options_.standing.block_s) return;
  const auto scatter = [&](const Eigen::Vector3d& squares, const Eigen::Vector3d& sum) {
    return std::sqrt((squares / b.count - (sum / b.count).cwiseAbs2()).cwiseMax(0).maxCoeff());
  };
  const Eigen::Vector3d rate = b.gyro / b.count - memory_.belief.state.gyro_bias_rad_s;
  const bool still = b.count >= 3 && scatter(b.gyro_squares, b.gyro) < options_.imu.still_gyro_rad_s &&
                     scatter(b.accel_squares, b.accel) < options_.imu.still_accel_m_s2 &&
                     rate.norm() < options_.imu.still_gyro_rad_s;
  b = {};
  b.from = sample.stamp;
  hold_still(still);
}

bool ErrorStateFilter::judge(LocalizationSensor sensor, double square, int rows, HealthReason why) {
  return memory_.judge(sensor).judge(square, gates_[static_cast<std::size_t>(rows)], why,
                                     options_.health.excluded_after, options_.health.back_after);
}

void ErrorStateFilter::correct_world(const Innovation& innovation) {
  const Pose before = memory_.belief.state.world_from_body;
  if (correct(memory_.belief, innovation)) keep_odom(before);
}

// Matches one after the other err alike (the same rocks, seen from afar first): they are no witness of a drift that
// vision keeps.
void ErrorStateFilter::correct_by_map(const Innovation& innovation) {
  const Pose before = memory_.belief.state.world_from_body;
  constexpr int kDrift = error_at::kVisionDrift, kCount = error_at::kVisionClone - error_at::kVisionDrift;
  if (correct_all_but(memory_.belief, innovation, kDrift, kCount)) keep_odom(before);
}

// odom_from_body stays as it was with the pose before: world_from_odom takes the change.
void ErrorStateFilter::keep_odom(const Pose& world_from_body_before) {
  memory_.world_from_odom =
      memory_.belief.state.world_from_body * world_from_body_before.inverse() * memory_.world_from_odom;
}

// odom_from_body becomes what it was at the clone, moved on by the motion as it is now believed.
void ErrorStateFilter::correct_motion(const Innovation& innovation, int clone) {
  if (!correct(memory_.belief, innovation)) return;
  const NavigationState& s = memory_.belief.state;
  const Pose odom_from_body =
      (clone == error_at::kVisionClone ? memory_.vision.odom_from_clone : memory_.step.odom_from_clone) *
      motion_since_clone(s, clone).clone_from_body;
  memory_.world_from_odom = s.world_from_body * odom_from_body.inverse();
}

UncertainPose ErrorStateFilter::odom_from_body() const {
  const MotionSinceClone motion = motion_since_clone(memory_.belief.state, error_at::kVisionClone);
  const Matrix6d covariance = motion.jacobian * memory_.belief.covariance * motion.jacobian.transpose();
  const Pose odom_from_body = memory_.world_from_odom.inverse() * memory_.belief.state.world_from_body;
  UncertainPose odom =
      compose({memory_.vision.odom_from_clone, memory_.vision.odom_covariance}, {motion.clone_from_body, covariance});
  odom.pose = odom_from_body;
  return odom;
}

}  // namespace spartan
