#include "spartan/localization/internal/error_state_filter.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "spartan/localization/internal/chi_square.h"
#include "spartan/localization/internal/kalman_update.h"
#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/localizer.h"

namespace spartan::internal {
namespace {

/// Standard deviation of the first pose, which defines the world: just large enough to keep the covariance regular.
constexpr double kExact = 1e-6;
/// Initial standard deviations: of quantities that were not measured, of the velocity of a stationary rover, and of the
/// vertical before the static alignment corrects it.
constexpr double kUnknownSpeed_m_s = 20, kRestingSpeed_m_s = 0.01;
constexpr double kAlignedTilt_rad = 0.5, kUnknownTilt_rad = 0.35, kUnknownHeading_rad = 10;
/// Random walk of the clock of the IMU: 20 ppm are 2 ms in 100 s.
constexpr double kClockWalk_s_sqrt_s = 2e-4;
/// Longest step of the constant-velocity model: beyond it the covariance stops growing.
constexpr double kMaxStep_s = 60;

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

}  // namespace

ErrorStateFilter::ErrorStateFilter(const LocalizationOptions& options)
    : options_(options), arm_(options.imu.position_m), wheel_centre_(arm_.from_imu(options.wheels.turning_centre_m)) {
  drift_sigma_ratios_ = six_of(options.vision.drift_sigma_ratios);
  constant_sigma_ratios_ = six_of(options.vision.constant_sigma_ratios);
  for (int rows = 1; rows <= 6; ++rows)
    gates_.by_rows[static_cast<std::size_t>(rows)] = chi_square_quantile(options.health.gate_probability, rows);
  gates_.vision = chi_square_quantile(options.vision.gate_probability, 6);
}

void ErrorStateFilter::start(Stamp stamp, const Eigen::Vector3d& ahead_in_body, std::span<const Measurement> before,
                             const std::optional<Eigen::Vector3d>& up_in_body,
                             const Eigen::Vector3d& assumed_up_in_body) {
  const auto imu = only<ImuSample>(before);
  const auto wheels = only<WheelSample>(before);
  const auto rest = static_reading(imu, options_);
  const auto tilt = median_tilt(only<InclinometerSample>(before), options_.inclinometer.min_sigma_rad);
  const auto heading = consensus_heading(only<CompassSample>(before), options_.compass.min_sigma_rad);
  const Eigen::Vector3d up = rest   ? rest->accel_m_s2.normalized()
                             : tilt ? up_of_roll_pitch(tilt->roll_rad, tilt->pitch_rad)
                                    : up_in_body.value_or(assumed_up_in_body.normalized());

  FilterMemory m;
  m.started = true;
  m.stamp = stamp;
  m.imu.aligned = rest && rest->stationary;  // otherwise its biases and the velocity are unknown
  m.gravity_known = rest || tilt;
  m.gravity_measured = m.gravity_known || up_in_body;
  m.compass.heading_east = m.compass.offset_known = heading.has_value();
  NavigationState& s = m.estimate.state;
  s.world_from_body = first_pose(up, ahead_in_body, 0);
  if (heading) s.world_from_body = first_pose(up, ahead_in_body, heading->radians - heading_of(s.world_from_body));
  s.world_from_body = arm_.imu_pose(s.world_from_body);

  ErrorCovariance& p = m.estimate.covariance;
  set_variance(p, error_at::kPose, 6, kExact);
  set_variance(p, error_at::kVelocity, 3, rest && rest->stationary ? kRestingSpeed_m_s : kUnknownSpeed_m_s);
  set_variance(p, error_at::kGyroBias, 3, std::max(options_.imu.gyro_bias_sigma_rad_s, 1e-9));
  set_variance(p, error_at::kAccelBias, 3, std::max(options_.imu.accel_bias_sigma_m_s2, 1e-9));
  set_variance(p, error_at::kGravityTilt, 2, m.gravity_known ? kAlignedTilt_rad : kUnknownTilt_rad);
  set_variance(p, error_at::kGravityScale, 1, std::max(options_.imu.accel_scale_sigma, 1e-9));
  set_variance(p, error_at::kImuTime, 1, std::max(options_.imu.time_offset_sigma_s, 1e-9));
  set_variance(p, error_at::kCalibration, 8, 1);
  set_variance(p, error_at::kWheelScale, 1, std::max(options_.wheels.scale_sigma, 1e-6));
  set_variance(p, error_at::kCompassOffset, 1,
               heading ? std::hypot(heading->sigma_rad, options_.compass.offset_sigma_rad) : kUnknownHeading_rad);
  set_variance(p, error_at::kInclinometerBias, 2, std::max(options_.inclinometer.bias_sigma_rad, 1e-9));
  p.diagonal().segment<6>(error_at::kVisionDrift) = drift_sigma_ratios_.cwiseAbs2().cwiseMax(1e-12);
  p.diagonal().segment<6>(error_at::kVisionConstant) = constant_sigma_ratios_.cwiseAbs2().cwiseMax(1e-12);

  // Static alignment: the means update tilt and biases; the pose defines the world and is not changed.
  if (rest) {
    correct(m.estimate, rest_innovation(s, rest->accel_m_s2, rest->accel_sigma_m_s2, options_.gravity_m_s2));
    if (rest->stationary) {
      Innovation bias(3);
      bias.residual = rest->gyro_rad_s - s.gyro_bias_rad_s;
      bias.jacobian.middleCols<3>(error_at::kGyroBias).setIdentity();
      bias.noise.diagonal().setConstant(rest->gyro_sigma_rad_s * rest->gyro_sigma_rad_s);
      correct(m.estimate, bias);
    }
  }
  if (tilt) correct(m.estimate, inclinometer_innovation(s, tilt->roll_rad, tilt->pitch_rad, tilt->sigma_rad));

  clone_pose(m.estimate, error_at::kVisionClone);
  clone_pose(m.estimate, error_at::kStepClone);
  m.world_from_odom = Pose();
  m.vision.clone_stamp = m.step.from = stamp;
  m.vision.odom_from_clone = m.step.odom_from_clone = s.world_from_body;
  for (const Measurement& sample : before) m.monitor(sensor_of(sample)).see(stamp_of_measurement(sample));
  m.monitor(LocalizationSensor::vision).see(stamp);
  if (!imu.empty()) {
    m.imu.known = true;
    m.imu.last = imu.back();
    m.imu.changed = m.imu.block.from = m.imu.level_from = imu.back().stamp;
    for (std::size_t i = 1; i < imu.size(); ++i) m.imu.noise.add(imu[i - 1], imu[i]);
    if (!m.imu.aligned) m.imu.window.begin(stamp);
    m.imu.waiting_since = stamp;
    m.step.stationary = m.imu.aligned;
  }
  if (!wheels.empty()) {
    m.wheels.known = true;
    m.wheels.last = m.wheels.previous = wheels.back();
    m.wheels.moved = *std::find_if(wheels.begin(), wheels.end(), [&](const WheelSample& w) {
      return std::abs(w.left_m - wheels.back().left_m) <= options_.zero_velocity.wheels_stationary_m &&
             std::abs(w.right_m - wheels.back().right_m) <= options_.zero_velocity.wheels_stationary_m;
    });
    m.step.has_wheels = seconds_between(wheels.back().stamp, stamp) < options_.health.wheels_timeout_s;
    m.step.wheels = wheels.back();
    m.vision.has_wheels = m.step.has_wheels;
    m.vision.wheels = m.step.wheels;
  }
  memory_ = m;
}

void ErrorStateFilter::process(const Measurement& measurement) {
  memory_.monitor(sensor_of(measurement)).see(stamp_of_measurement(measurement));
  std::visit([this](const auto& value) { update(value); }, measurement);
}

bool ErrorStateFilter::inertial_usable() const {
  return memory_.imu.known && memory_.imu.aligned &&
         memory_.monitor(LocalizationSensor::imu).state != SensorState::excluded;
}

// Uses the readings up to that time. If the next one is known already, the last step is interpolated.
void ErrorStateFilter::advance_to(Stamp stamp) {
  use_waiting_until(stamp);
  const ImuQueue& waiting = memory_.imu.waiting;
  if (waiting.empty() || !is_possible(waiting.front())) {
    propagate_to(stamp, nullptr);
  } else {
    const ImuSample next = at_frame_time(waiting.front());
    propagate_to(stamp, &next);
  }
}

// With an IMU sample at or after the end of the step both ends are measured; otherwise the last reading is held up to
// the timeout.
void ErrorStateFilter::propagate_to(Stamp stamp, const ImuSample* next) {
  const double seconds = seconds_between(memory_.stamp, stamp);
  if (!(seconds > 0)) return;
  const ImuSample& last = memory_.imu.last;
  if (inertial_usable() && seconds_between(last.stamp, stamp) <= options_.imu.timeout_s) {
    if (next != nullptr) {
      propagate_inertially(seconds, interpolate(last, *next, memory_.stamp), interpolate(last, *next, stamp));
    } else {
      propagate_inertially(seconds, last, last);
    }
  } else {
    propagate_at_constant_velocity(std::min(seconds, kMaxStep_s));
  }
  propagate_biases(seconds);
  memory_.stamp = stamp;
}

void ErrorStateFilter::propagate_inertially(double seconds, const ImuSample& from, const ImuSample& to) {
  const InertialStep step{from.gyro_rad_s, to.gyro_rad_s, from.accel_m_s2, to.accel_m_s2, seconds};
  const InertialNoise noise = inertial_noise(options_.imu, memory_.imu.noise);
  propagate_covariance(memory_.estimate, transition(memory_.estimate.state, step, noise, options_.gravity_m_s2));
  memory_.estimate.state = propagate(memory_.estimate.state, step, options_.gravity_m_s2);
}

void ErrorStateFilter::propagate_at_constant_velocity(double seconds) {
  const ConstantVelocityOptions& o = options_.constant_velocity;
  VisionMemory& vision = memory_.vision;
  const ConstantVelocityStep step{vision.rate_rad_s, seconds};
  const double speed = memory_.estimate.state.velocity_m_s.norm(), rate = vision.rate_rad_s.norm();
  // The angular rate of a rocking rover changes slowly, so that the attitude error grows as σ t;
  // (t + dt)² − t² = (2 t + dt) dt.
  const double rotation =
      o.rate_sigma_ratio * (rate + o.rate_offset_rad_s) * std::sqrt(2 * vision.constant_velocity_s + seconds);
  const ConstantVelocityNoise noise{o.speed_sigma_ratio_per_sqrt_s * (speed + o.speed_offset_m_s), rotation};
  const Transition t = transition(memory_.estimate.state, step, noise);
  const Matrix9d by = t.by_moving.topLeftCorner<9, 9>();
  vision.constant_velocity_noise =
      (by * vision.constant_velocity_noise * by.transpose()).eval() + t.noise.topLeftCorner<9, 9>();
  vision.constant_velocity_s += seconds;
  propagate_covariance(memory_.estimate, t);
  memory_.estimate.state = propagate(memory_.estimate.state, step);
}

void ErrorStateFilter::propagate_biases(double seconds) {
  ErrorCovariance& p = memory_.estimate.covariance;
  const auto square = [](double x) { return x * x; };
  if (p(error_at::kImuTime, error_at::kImuTime) < square(options_.imu.time_offset_sigma_s))
    p(error_at::kImuTime, error_at::kImuTime) += square(kClockWalk_s_sqrt_s) * seconds;
  if (p(error_at::kWheelScale, error_at::kWheelScale) < square(options_.wheels.scale_sigma))
    p(error_at::kWheelScale, error_at::kWheelScale) += square(options_.wheels.scale_walk_per_sqrt_s) * seconds;
  p(error_at::kCompassOffset, error_at::kCompassOffset) +=
      square(options_.compass.offset_walk_rad_per_sqrt_s) * seconds;
  p.diagonal().segment<2>(error_at::kInclinometerBias).array() +=
      square(options_.inclinometer.bias_walk_rad_per_sqrt_s) * seconds;
}

bool ErrorStateFilter::accept(LocalizationSensor sensor, double nis, int rows, HealthReason why) {
  return memory_.monitor(sensor).accept(nis, gates_.by_rows[static_cast<std::size_t>(rows)], why,
                                        options_.health.excluded_after, options_.health.readmit_after);
}

void ErrorStateFilter::correct_world(const Innovation& innovation) {
  const Pose before = memory_.estimate.state.world_from_body;
  if (correct(memory_.estimate, innovation)) preserve_odom(before);
}

// Errors of consecutive map matches are correlated (the same rocks, seen from afar first), so they must not update the
// drift states of vision (Schmidt).
void ErrorStateFilter::correct_by_map(const Innovation& innovation) {
  const Pose before = memory_.estimate.state.world_from_body;
  constexpr int kDrift = error_at::kVisionDrift, kCount = error_at::kVisionClone - error_at::kVisionDrift;
  if (correct_all_but(memory_.estimate, innovation, kDrift, kCount)) preserve_odom(before);
}

// odom_from_body is preserved: world_from_odom takes the correction.
void ErrorStateFilter::preserve_odom(const Pose& world_from_body_before) {
  memory_.world_from_odom =
      memory_.estimate.state.world_from_body * world_from_body_before.inverse() * memory_.world_from_odom;
}

// odom_from_body becomes its value at the clone times the corrected motion since.
void ErrorStateFilter::correct_motion(const Innovation& innovation, int clone) {
  if (correct(memory_.estimate, innovation)) set_odom_by_motion(clone);
}

// Pose and velocity only: between two frames without an IMU, wheels say nothing about errors that vision measures.
void ErrorStateFilter::correct_prediction(const Innovation& innovation) {
  constexpr int kFirst = error_at::kGyroBias;
  if (correct_all_but(memory_.estimate, innovation, kFirst, error_at::kSize - kFirst))
    set_odom_by_motion(error_at::kStepClone);
}

void ErrorStateFilter::set_odom_by_motion(int clone) {
  const NavigationState& s = memory_.estimate.state;
  const Pose odom_from_body =
      (clone == error_at::kVisionClone ? memory_.vision.odom_from_clone : memory_.step.odom_from_clone) *
      motion_since_clone(s, clone).clone_from_body;
  memory_.world_from_odom = s.world_from_body * odom_from_body.inverse();
}

UncertainPose ErrorStateFilter::body_pose(const StateEstimate& e) const {
  return arm_.body_pose({e.state.world_from_body, e.covariance.block<6, 6>(error_at::kPose, error_at::kPose)});
}

UncertainPose ErrorStateFilter::odom_from_body() const {
  return arm_.body_pose(odom_from_imu());
}

// v_B = v_N + ω × (p_B − p_N).
Eigen::Vector3d ErrorStateFilter::velocity() const {
  const NavigationState& s = memory_.estimate.state;
  const Eigen::Vector3d rate =
      inertial_usable() ? memory_.imu.last.gyro_rad_s - s.gyro_bias_rad_s : memory_.vision.rate_rad_s;
  return s.world_from_body.rotation() * (s.velocity_m_s + rate.cross(arm_.from_imu(Eigen::Vector3d::Zero())));
}

UncertainPose ErrorStateFilter::odom_from_imu() const {
  const MotionSinceClone motion = motion_since_clone(memory_.estimate.state, error_at::kVisionClone);
  const Matrix6d covariance = motion.jacobian * memory_.estimate.covariance * motion.jacobian.transpose();
  const Pose odom_from_body = memory_.world_from_odom.inverse() * memory_.estimate.state.world_from_body;
  UncertainPose odom =
      compose({memory_.vision.odom_from_clone, memory_.vision.odom_covariance}, {motion.clone_from_body, covariance});
  odom.pose = odom_from_body;
  return odom;
}

}  // namespace spartan::internal
