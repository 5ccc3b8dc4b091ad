#include "spartan/sim/internal/drive/motion_sensors.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "spartan/core/pose.h"
#include "spartan/numerics/gradient_noise.h"
#include "spartan/numerics/random.h"

namespace spartan::sim::internal {
namespace {

constexpr std::int64_t kEpoch_ns = 1'000'000'000'000;  // stamp of the start of every drive: 1000 s

Eigen::Vector3d normal_vector(Random& random, double sigma) {
  return {random.normal(0, sigma), random.normal(0, sigma), random.normal(0, sigma)};
}

// Samples at the sensor's rate: calls `read(t)` for each in order; faults then drop samples or repeat the last one.
template <class Sample, class Read>
std::vector<Sample> sample_sensor(const BodyMotion& motion, double rate_hz, MotionSensor sensor,
                                  const SensorFaults& faults, const Read& read) {
  std::vector<Sample> samples;
  std::optional<Sample> last;
  const auto count = static_cast<std::int64_t>(std::floor(motion.seconds() * rate_hz));
  for (std::int64_t i = 0; i <= count; ++i) {
    const double t = static_cast<double>(i) / rate_hz;
    Sample sample = read(t);  // always called, so that a fault does not shift the random numbers of other samples
    sample.stamp = stamp_at(t);
    const auto fault = std::find_if(faults.begin(), faults.end(), [&](const SensorFault& f) {
      return f.sensor == sensor && t >= f.from_s && t < f.to_s;
    });
    if (fault == faults.end()) {
      last = sample;
    } else if (fault->kind == SensorFaultKind::drop || !last) {
      continue;
    } else {
      sample = *last;
      sample.stamp = stamp_at(t);
    }
    samples.push_back(sample);
  }
  return samples;
}

}  // namespace

Stamp stamp_at(double time_s) {
  return {kEpoch_ns + std::llround(time_s * 1e9)};
}

ImuSample true_imu(const BodyMotion& motion, double time_s, double gravity_m_s2) {
  ImuSample sample;
  sample.stamp = stamp_at(time_s);
  sample.gyro_rad_s = motion.angular_velocity(time_s);
  sample.accel_m_s2 = motion.world_from_body(time_s).rotation().conjugate() *
                      (motion.acceleration(time_s) + Eigen::Vector3d(0, 0, gravity_m_s2));
  return sample;
}

SensorNoise specified_noise(const ImuOptions& imu, const CompassOptions& compass,
                            const InclinometerOptions& inclinometer) {
  // The biases are constant over a drive. Zero would mean that no value is specified, so this is a negligible random
  // walk.
  constexpr double kNoWalk_rad_sqrt_hz = 1e-7;
  SensorNoise noise;
  if (imu.enabled) {
    noise.imu = {imu.gyro_noise_rad_s_sqrt_hz, imu.gyro_bias_rad_s, imu.gyro_walk_rad_s2_sqrt_hz,
                 imu.accel_noise_m_s2_sqrt_hz, imu.accel_bias_m_s2, imu.accel_walk_m_s3_sqrt_hz};
  }
  if (compass.enabled) noise.compass = {kNoWalk_rad_sqrt_hz};
  if (inclinometer.enabled) noise.inclinometer = {inclinometer.bias_deg * kRadiansPerDegree, kNoWalk_rad_sqrt_hz};
  return noise;
}

namespace {

ImuSample imu_at(const BodyMotion& motion, double time_s, double gravity_m_s2, const std::vector<double>& position_m) {
  ImuSample sample = true_imu(motion, time_s, gravity_m_s2);
  if (position_m.empty()) return sample;
  constexpr double kStep_s = 1e-3;
  const Eigen::Vector3d arm(position_m[0], position_m[1], position_m[2]), &rate = sample.gyro_rad_s;
  const Eigen::Vector3d angular_acceleration =
      (motion.angular_velocity(time_s + kStep_s) - motion.angular_velocity(time_s - kStep_s)) / (2 * kStep_s);
  sample.accel_m_s2 += angular_acceleration.cross(arm) + rate.cross(rate.cross(arm));
  return sample;
}

// Scale errors on the diagonal, and the tilts of each axis towards the others beside it.
Eigen::Matrix3d axis_errors(Random& random, const ImuOptions& o) {
  Eigen::Matrix3d errors;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      errors(row, column) = row == column ? random.normal(0, 0.01 * o.scale_percent)
                                          : random.normal(0, o.misalignment_deg * kRadiansPerDegree);
    }
  }
  return errors;
}

Eigen::Vector3d quantized(const Eigen::Vector3d& value, double step) {
  if (step <= 0) return value;
  return (value / step).array().round().matrix() * step;
}

}  // namespace

std::vector<ImuSample> measure_imu(const BodyMotion& motion, const ImuOptions& o, double gravity_m_s2,
                                   const SensorFaults& faults, std::uint64_t seed) {
  if (!o.enabled) return {};
  Random random(seed, 201), axes(seed, 211), vibration(seed, 212);
  Eigen::Vector3d gyro_bias = normal_vector(random, o.gyro_bias_rad_s);
  Eigen::Vector3d accel_bias = normal_vector(random, o.accel_bias_m_s2);
  const Eigen::Matrix3d gyro_axes = axis_errors(axes, o), accel_axes = axis_errors(axes, o);
  const double root_rate = std::sqrt(o.rate_hz);
  return sample_sensor<ImuSample>(motion, o.rate_hz, MotionSensor::imu, faults, [&](double t) {
    const double measured_s = t - 1e-3 * o.delay_ms;
    ImuSample sample = imu_at(motion, measured_s, gravity_m_s2, o.position_m);
    const double speed = motion.velocity(measured_s).norm();
    sample.gyro_rad_s += gyro_axes * sample.gyro_rad_s + normal_vector(vibration, o.gyro_vibration_rad_m * speed);
    sample.accel_m_s2 += accel_axes * sample.accel_m_s2 + normal_vector(vibration, o.accel_vibration_1_s * speed);
    sample.gyro_rad_s += gyro_bias + normal_vector(random, o.gyro_noise_rad_s_sqrt_hz * root_rate);
    sample.accel_m_s2 += accel_bias + normal_vector(random, o.accel_noise_m_s2_sqrt_hz * root_rate);
    sample.gyro_rad_s = quantized(sample.gyro_rad_s, o.gyro_step_rad_s);
    sample.accel_m_s2 = quantized(sample.accel_m_s2, o.accel_step_m_s2);
    gyro_bias += normal_vector(random, o.gyro_walk_rad_s2_sqrt_hz / root_rate);
    accel_bias += normal_vector(random, o.accel_walk_m_s3_sqrt_hz / root_rate);
    return sample;
  });
}

std::vector<WheelSample> measure_wheels(const BodyMotion& motion, const ChassisOptions& chassis, const WheelOptions& o,
                                        const SensorFaults& faults, std::uint64_t seed) {
  if (!o.enabled) return {};
  Random random(seed, 202);
  const double left_scale = 1 + random.normal(0, o.radius_error), right_scale = 1 + random.normal(0, o.radius_error);
  const std::vector<Octave> sand = make_octaves(random.next(), 3, o.sand_size_m, 0.6, o.slip_sand);
  double left_m = 0, right_m = 0, before = 0;
  const auto counted = [&](double rolled) {
    return o.resolution_m > 0 ? std::floor(rolled / o.resolution_m) * o.resolution_m : rolled;
  };
  return sample_sensor<WheelSample>(motion, o.rate_hz, MotionSensor::wheels, faults, [&](double t) {
    // Midpoint rule between samples.
    const double middle = 0.5 * (before + t), step = t - before;
    const Pose pose = motion.world_from_body(middle);
    const Eigen::Vector3d ahead = pose.rotation() * Eigen::Vector3d::UnitX();
    const double forward = (motion.velocity(middle) - motion.creep_velocity(middle)).dot(ahead);
    const double turning = motion.angular_velocity(middle).z() * chassis.track_m / 2 * (1 + o.turn_skid);
    double slip =
        o.slip_level + o.slip_by_slope * ahead.z() / std::hypot(ahead.x(), ahead.y()) * (forward < 0 ? -1 : 1);
    for (const Octave& octave : sand) slip += octave.value(pose.translation().x(), pose.translation().y());
    const double rolled = 1 / (1 - std::clamp(slip, -0.5, 0.9));
    left_m += (forward - turning) * rolled * left_scale * step;
    right_m += (forward + turning) * rolled * right_scale * step;
    before = t;
    return WheelSample{{}, counted(left_m), counted(right_m)};
  });
}

std::vector<CompassSample> measure_compass(const BodyMotion& motion, const CompassOptions& o,
                                           const SensorFaults& faults, std::uint64_t seed) {
  if (!o.enabled) return {};
  Random random(seed, 203);
  const double bias = random.normal(0, o.bias_deg * kRadiansPerDegree), sigma = o.sigma_deg * kRadiansPerDegree;
  return sample_sensor<CompassSample>(motion, o.rate_hz, MotionSensor::compass, faults, [&](double t) {
    const bool outlier = random.uniform() < o.outlier_fraction;
    const double error = bias + random.normal(0, sigma), anywhere = random.uniform(-std::numbers::pi, std::numbers::pi);
    const double heading = outlier ? anywhere : motion.roll_pitch_yaw(t).z() + error;
    return CompassSample{{}, std::remainder(heading, 2 * std::numbers::pi), sigma};
  });
}

std::vector<InclinometerSample> measure_inclinometer(const BodyMotion& motion, const InclinometerOptions& o,
                                                     const SensorFaults& faults, std::uint64_t seed) {
  if (!o.enabled) return {};
  Random random(seed, 204);
  const double sigma = o.sigma_deg * kRadiansPerDegree;
  const double roll_bias = random.normal(0, o.bias_deg * kRadiansPerDegree);
  const double pitch_bias = random.normal(0, o.bias_deg * kRadiansPerDegree);
  return sample_sensor<InclinometerSample>(motion, o.rate_hz, MotionSensor::inclinometer, faults, [&](double t) {
    const Eigen::Vector3d angles = motion.roll_pitch_yaw(t);
    const double roll = angles.x() + roll_bias + random.normal(0, sigma);
    return InclinometerSample{{}, roll, angles.y() + pitch_bias + random.normal(0, sigma), sigma};
  });
}

}  // namespace spartan::sim::internal
