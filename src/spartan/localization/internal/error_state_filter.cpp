#include "spartan/localization/internal/error_state_filter.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "spartan/localization/internal/kalman_update.h"
#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/internal/updates/filter_correction.h"
#include "spartan/localization/localizer.h"

namespace spartan::internal {
namespace {

/// Standard deviation of the first pose, which defines the world: just large enough to keep the covariance regular.
constexpr double kExact = 1e-6;
/// Initial standard deviations: of quantities that were not measured, of the velocity of a stationary rover, and of the
/// vertical before the static alignment corrects it.
constexpr double kUnknownSpeed_m_s = 20, kRestingSpeed_m_s = 0.01;
constexpr double kAlignedTilt_rad = 0.5, kUnknownTilt_rad = 0.35, kUnknownHeading_rad = 10;

void set_variance(ErrorCovariance& p, int at, int size, double sigma) {
  p.diagonal().segment(at, size).setConstant(sigma * sigma);
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
    : options_(options),
      arm_(options.imu.position_m),
      drift_(options.vision),
      imu_(options),
      motions_(options),
      wheels_(options),
      compass_(options),
      inclinometer_(options),
      map_(options) {}

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
  drift_.start(p);

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
  const Stamp stamp = stamp_of_measurement(measurement);
  memory_.monitor(sensor_of(measurement)).see(stamp);
  if (!std::holds_alternative<ImuSample>(measurement)) predict_to(stamp);
  std::visit([this](const auto& value) { update(value); }, measurement);
}

UncertainPose ErrorStateFilter::body_pose(const StateEstimate& e) const {
  return arm_.body_pose({e.state.world_from_body, e.covariance.block<6, 6>(error_at::kPose, error_at::kPose)});
}

UncertainPose ErrorStateFilter::odom_from_body() const {
  return arm_.body_pose(odom_from_imu(memory_));
}

// v_B = v_N + ω × (p_B − p_N).
Eigen::Vector3d ErrorStateFilter::velocity() const {
  const NavigationState& s = memory_.estimate.state;
  const Eigen::Vector3d rate =
      memory_.inertial_usable() ? memory_.imu.last.gyro_rad_s - s.gyro_bias_rad_s : memory_.vision.rate_rad_s;
  return s.world_from_body.rotation() * (s.velocity_m_s + rate.cross(arm_.from_imu(Eigen::Vector3d::Zero())));
}

}  // namespace spartan::internal
