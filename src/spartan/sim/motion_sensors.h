// What the rover's other sensors say of its motion, with their errors.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "spartan/camera/samples.h"
#include "spartan/camera/sensor_noise.h"
#include "spartan/core/options.h"
#include "spartan/sim/body_motion.h"

namespace spartan::sim {

/// Errors as of an Allan deviation: white noise by density, bias as a constant of the drive plus a random walk.
struct ImuOptions {
  bool enabled = true;
  double rate_hz = 100;
  double gyro_noise_rad_s_sqrt_hz = 1e-4;
  double gyro_bias_rad_s = 5e-5;
  double gyro_walk_rad_s2_sqrt_hz = 2e-6;
  double accel_noise_m_s2_sqrt_hz = 1e-3;
  double accel_bias_m_s2 = 5e-3;
  double accel_walk_m_s3_sqrt_hz = 5e-5;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled, "whether the rover has one");
    v.field("rate_hz", rate_hz, "samples a second", between(1, 2000));
    v.field("gyro_noise_rad_s_sqrt_hz", gyro_noise_rad_s_sqrt_hz, "white noise, density", at_least(0));
    v.field("gyro_bias_rad_s", gyro_bias_rad_s, "standard deviation of the bias at the start", at_least(0));
    v.field("gyro_walk_rad_s2_sqrt_hz", gyro_walk_rad_s2_sqrt_hz, "random walk of the bias, density", at_least(0));
    v.field("accel_noise_m_s2_sqrt_hz", accel_noise_m_s2_sqrt_hz, "white noise, density", at_least(0));
    v.field("accel_bias_m_s2", accel_bias_m_s2, "standard deviation of the bias at the start", at_least(0));
    v.field("accel_walk_m_s3_sqrt_hz", accel_walk_m_s3_sqrt_hz, "random walk of the bias, density", at_least(0));
  }
};

/// Slip: the share of the rolled distance that does not carry the rover on,
///   slip = level + by_slope · tan(climb) + sand · noise(x, y),  rolled = travelled / (1 − slip).
struct WheelOptions {
  bool enabled = true;
  double rate_hz = 20;
  double slip_level = 0.02;
  double slip_by_slope = 1;
  double slip_sand = 0.03;
  double sand_size_m = 2;
  double radius_error = 0.005;
  double resolution_m = 0.0005;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled, "whether the rover counts their turns");
    v.field("rate_hz", rate_hz, "samples a second", between(0.1, 1000));
    v.field("slip_level", slip_level, "slip on level ground", between(-0.5, 0.9));
    v.field("slip_by_slope", slip_by_slope, "slip for a climb of 45°", between(0, 5));
    v.field("slip_sand", slip_sand, "standard deviation of slip between patches of sand", between(0, 0.5));
    v.field("sand_size_m", sand_size_m, "size of the patches", between(0.1, 100));
    v.field("radius_error", radius_error, "standard deviation of each side's scale", between(0, 0.2));
    v.field("resolution_m", resolution_m, "smallest step that is counted", between(0, 0.1));
  }
};

/// A compass or sun sensor.
struct CompassOptions {
  bool enabled = true;
  double rate_hz = 1;
  double sigma_deg = 1;
  double bias_deg = 1;
  double outlier_share = 0.02;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled, "whether the rover has one");
    v.field("rate_hz", rate_hz, "samples a second", between(0.01, 100));
    v.field("sigma_deg", sigma_deg, "standard deviation of a reading, as the rover believes it", between(0, 90));
    v.field("bias_deg", bias_deg, "standard deviation of the bias of the drive", between(0, 90));
    v.field("outlier_share", outlier_share, "readings that point anywhere", between(0, 1));
  }
};

struct InclinometerOptions {
  bool enabled = true;
  double rate_hz = 5;
  double sigma_deg = 0.2;
  double bias_deg = 0.1;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled, "whether the rover has one");
    v.field("rate_hz", rate_hz, "samples a second", between(0.01, 1000));
    v.field("sigma_deg", sigma_deg, "standard deviation of a reading, as the rover believes it", between(0, 45));
    v.field("bias_deg", bias_deg, "standard deviation of the bias of the drive", between(0, 45));
  }
};

/// What a recording states of them.
SensorNoise stated_noise(const ImuOptions& imu, const CompassOptions& compass, const InclinometerOptions& inclinometer);

/// A sensor that is silent, or repeats its last reading, for a while.
struct SensorFault {
  std::string sensor = "imu";
  std::string kind = "drop";
  double from_s = 0, to_s = 0;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("sensor", sensor, "which", {"imu", "wheels", "compass", "inclinometer"});
    v.field("kind", kind, "silent, or the same reading again and again", {"drop", "freeze"});
    v.field("from_s", from_s, "since the recording's start", at_least(0));
    v.field("to_s", to_s, "since the recording's start", at_least(0));
  }
};
using SensorFaults = std::vector<SensorFault>;

/// The recording's clock at a time of the drive.
Stamp stamp_at(double time_s);

/// Angular rate and specific force in the body frame without errors.
ImuSample true_imu(const BodyMotion& motion, double time_s, double gravity_m_s2);

std::vector<ImuSample> measure_imu(const BodyMotion& motion, const ImuOptions& options, double gravity_m_s2,
                                   const SensorFaults& faults, std::uint64_t seed);
std::vector<WheelSample> measure_wheels(const BodyMotion& motion, const ChassisOptions& chassis,
                                        const WheelOptions& options, const SensorFaults& faults, std::uint64_t seed);
std::vector<CompassSample> measure_heading(const BodyMotion& motion, const CompassOptions& options,
                                           const SensorFaults& faults, std::uint64_t seed);
std::vector<InclinometerSample> measure_tilt(const BodyMotion& motion, const InclinometerOptions& options,
                                             const SensorFaults& faults, std::uint64_t seed);

}  // namespace spartan::sim
