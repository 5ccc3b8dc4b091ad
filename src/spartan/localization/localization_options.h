// Options of the localization. One set of defaults serves all recordings.
#pragma once

#include <vector>

#include "spartan/camera/sensor_noise.h"
#include "spartan/core/options.h"

namespace spartan {

/// White noise by density, biases by their standard deviation at the start and a random walk.
struct InertialOptions {
  double gyro_noise_rad_s_sqrt_hz = 1.2e-4;
  double gyro_bias_rad_s = 2e-4;
  double gyro_walk_rad_s2_sqrt_hz = 3e-6;
  double accel_noise_m_s2_sqrt_hz = 1.5e-3;
  double accel_bias_m_s2 = 0.02;
  double accel_walk_m_s3_sqrt_hz = 1e-4;
  double timeout_s = 0.25;
  double frozen_s = 0.5;
  double level_after_s = 1.0;
  double still_gyro_rad_s = 0.004;
  double still_accel_m_s2 = 0.03;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("gyro_noise_rad_s_sqrt_hz", gyro_noise_rad_s_sqrt_hz, "white noise, density", between(1e-8, 1));
    v.field("gyro_bias_rad_s", gyro_bias_rad_s, "standard deviation of the bias at the start", between(0, 1));
    v.field("gyro_walk_rad_s2_sqrt_hz", gyro_walk_rad_s2_sqrt_hz, "random walk of the bias", between(0, 1));
    v.field("accel_noise_m_s2_sqrt_hz", accel_noise_m_s2_sqrt_hz, "white noise, density", between(1e-8, 10));
    v.field("accel_bias_m_s2", accel_bias_m_s2, "standard deviation of the bias at the start", between(0, 10));
    v.field("accel_walk_m_s3_sqrt_hz", accel_walk_m_s3_sqrt_hz, "random walk of the bias", between(0, 10));
    v.field("timeout_s", timeout_s, "a longer gap between samples is not bridged by them", between(1e-3, 10));
    v.field("frozen_s", frozen_s, "the same reading for so long: the sensor has frozen", between(0.01, 100));
    v.field("level_after_s", level_after_s, "an IMU that starts during the drive finds gravity over so long",
            between(0.1, 100));
    v.field("still_gyro_rad_s", still_gyro_rad_s, "scatter below which the rover may be standing", between(0, 1));
    v.field("still_accel_m_s2", still_accel_m_s2, "scatter below which the rover may be standing", between(0, 10));
  }
};

/// The error of a visual motion is L n + D z: white noise of the stated covariance times `white_factor`, and a lasting
/// part z in units of the stated standard deviations D, slowly changing and constant (docs/math/localization.md,
/// "Vision").
struct VisionOptions {
  double white_factor = 1.1;
  std::vector<double> drift_sigmas{0.85, 0.61, 0.33, 0.57, 0.46, 0.35};
  double drift_steps = 57;
  std::vector<double> constant_sigmas{1.05, 0.76, 0.4, 0.7, 0.57, 0.42};
  double gate_probability = 0.999999;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("white_factor", white_factor, "on the stated covariance, for errors that differ from shot to shot",
            between(0.01, 1e4));
    v.field("drift_sigmas", drift_sigmas,
            "standard deviation of the errors that last for a while, over the stated ones: x, y, z, about x, y, z",
            between(0, 1e3), Length{6});
    v.field("drift_steps", drift_steps, "after so many shots such an error has fallen to 1/e", between(1, 1e6));
    v.field("constant_sigmas", constant_sigmas, "the same of the errors that stay for the whole drive", between(0, 1e3),
            Length{6});
    v.field("gate_probability", gate_probability, "share of good motions that the test lets pass",
            between(0.5, 1 - 1e-12));
  }
};

struct WheelOdometryOptions {
  double track_m = 0.6;
  double scale_sigma = 0.1;
  double scale_walk_sqrt_hz = 0.005;
  double forward_share = 0.12;
  double side_share = 0.2;
  double up_share = 0.3;
  double turn_share = 0.3;
  double floor_m = 0.002;
  double longest_step_s = 2.5;
  double least_slip_distance_m = 0.02;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("track_m", track_m, "between left and right wheels; 0: turns are not taken from them", between(0, 10));
    v.field("scale_sigma", scale_sigma, "of travelled over counted distance (radius, mean slip)", between(0, 1));
    v.field("scale_walk_sqrt_hz", scale_walk_sqrt_hz, "how it changes", between(0, 1));
    v.field("forward_share", forward_share, "slip that differs from that of the mean, of the distance", between(0, 1));
    v.field("side_share", side_share, "motion to the side, of the distance", between(0, 10));
    v.field("up_share", up_share, "motion along the body's vertical, of the distance", between(0, 10));
    v.field("turn_share", turn_share, "error of a turn, of the turn", between(0, 10));
    v.field("floor_m", floor_m, "least standard deviation of a step", between(1e-6, 1));
    v.field("longest_step_s", longest_step_s, "a step ends with a shot, or after so long", between(0.1, 100));
    v.field("least_slip_distance_m", least_slip_distance_m, "slip is stated for steps of this length",
            between(1e-3, 10));
  }
};

struct HeadingOptions {
  double least_sigma_rad = 0.002;
  double offset_sigma_rad = 0.003;
  double offset_walk_rad_sqrt_hz = 1.5e-4;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("least_sigma_rad", least_sigma_rad, "of a reading, whatever it says itself", between(1e-6, 1));
    v.field("offset_sigma_rad", offset_sigma_rad, "of what changes between start and drive", between(0, 1));
    v.field("offset_walk_rad_sqrt_hz", offset_walk_rad_sqrt_hz, "random walk of the bias", between(0, 1));
  }
};

struct TiltOptions {
  double noise_factor = 1.0;
  double least_sigma_rad = 0.0005;
  double bias_rad = 0.0025;
  double bias_walk_rad_sqrt_hz = 1e-5;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("noise_factor", noise_factor, "on the stated standard deviation, for one that feels accelerations too",
            between(0.1, 100));
    v.field("least_sigma_rad", least_sigma_rad, "of a reading, whatever it says itself", between(1e-6, 1));
    v.field("bias_rad", bias_rad, "standard deviation of the bias", between(0, 1));
    v.field("bias_walk_rad_sqrt_hz", bias_walk_rad_sqrt_hz, "random walk of the bias", between(0, 1));
  }
};

struct StandingStillOptions {
  bool enabled = true;
  double block_s = 0.5;
  double wheels_still_s = 1.0;
  double wheels_still_m = 0.001;
  double position_m = 5e-4;
  double attitude_rad = 2e-4;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled, "hold the pose while IMU and wheels (or vision) say that the rover stands");
    v.field("block_s", block_s, "over which the IMU's scatter is taken", between(0.05, 10));
    v.field("wheels_still_s", wheels_still_s, "the wheels must have stood for so long", between(0, 100));
    v.field("wheels_still_m", wheels_still_m, "a count that changes by less stands", between(0, 1));
    v.field("position_m", position_m, "how still a standing rover is", between(1e-7, 1));
    v.field("attitude_rad", attitude_rad, "how still a standing rover is", between(1e-8, 1));
  }
};

/// Without an IMU the rover is taken to keep its velocity in the body frame. Densities grow with speed, so that the
/// same options serve a rover and a car: σ = share · (|v| + floor).
struct UnmeasuredMotionOptions {
  double speed_share_sqrt_hz = 0.5;
  double speed_floor_m_s = 0.05;
  double turn_share = 0.5;
  double turn_floor_rad_s = 0.008;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("speed_share_sqrt_hz", speed_share_sqrt_hz, "change of velocity in a second, of the speed",
            between(0, 100));
    v.field("speed_floor_m_s", speed_floor_m_s, "the speed counts as so much more", between(0, 100));
    v.field("turn_share", turn_share, "error of the last rate, of the rate", between(0, 100));
    v.field("turn_floor_rad_s", turn_floor_rad_s, "the rate counts as so much more", between(0, 100));
  }
};

struct HealthOptions {
  double gate_probability = 0.999;
  int excluded_after = 3;
  int back_after = 5;
  double vision_timeout_s = 10;
  double wheels_timeout_s = 2;
  double compass_timeout_s = 10;
  double inclinometer_timeout_s = 5;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("gate_probability", gate_probability, "share of good samples that the chi-square tests let pass",
            between(0.5, 1 - 1e-12));
    v.field("excluded_after", excluded_after, "so many refusals in a row exclude a sensor", between(1, 1000));
    v.field("back_after", back_after, "so many samples in a row that fit bring it back", between(1, 1000));
    v.field("vision_timeout_s", vision_timeout_s, "silence that counts as missing", between(0.01, 1e4));
    v.field("wheels_timeout_s", wheels_timeout_s, "silence that counts as missing", between(0.01, 1e4));
    v.field("compass_timeout_s", compass_timeout_s, "silence that counts as missing", between(0.01, 1e4));
    v.field("inclinometer_timeout_s", inclinometer_timeout_s, "silence that counts as missing", between(0.01, 1e4));
  }
};

struct LocalizationOptions {
  double gravity_m_s2 = 9.81;  ///< of the planet; whoever makes a Localizer knows it
  double buffer_s = 15;
  double map_factor = 1;
  InertialOptions imu;
  VisionOptions vision;
  WheelOdometryOptions wheels;
  HeadingOptions compass;
  TiltOptions inclinometer;
  StandingStillOptions standing;
  UnmeasuredMotionOptions unmeasured;
  HealthOptions health;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("buffer_s", buffer_s, "samples that come later than this are refused", between(0, 600));
    v.field("map_factor", map_factor, "on the covariance of map constraints", between(0.01, 1e4));
    v.group("imu", imu);
    v.group("vision", vision);
    v.group("wheels", wheels);
    v.group("compass", compass);
    v.group("inclinometer", inclinometer);
    v.group("standing", standing);
    v.group("unmeasured", unmeasured);
    v.group("health", health);
  }
};

/// Replaces defaults by the noise that a recording specifies for its sensors. Kept are values whose keys were given (in
/// a config file or with --set; `given` holds keys of LocalizationOptions), even where they are the default, and values
/// that differ from the default (set in code).
inline LocalizationOptions with_specified_noise(LocalizationOptions options, const SensorNoise& stated,
                                                const GivenKeys& given = {}) {
  const LocalizationOptions defaults;
  const auto take = [&](const char* key, double& value, double by_default, double by_recording) {
    if (!given.contains(key) && value == by_default && by_recording > 0) value = by_recording;
  };
  const auto take_imu = [&](const char* key, double InertialOptions::*ours, double ImuNoise::*theirs) {
    take(key, options.imu.*ours, defaults.imu.*ours, stated.imu.*theirs);
  };
  take_imu("imu.gyro_noise_rad_s_sqrt_hz", &InertialOptions::gyro_noise_rad_s_sqrt_hz,
           &ImuNoise::gyro_noise_rad_s_sqrt_hz);
  take_imu("imu.gyro_bias_rad_s", &InertialOptions::gyro_bias_rad_s, &ImuNoise::gyro_bias_rad_s);
  take_imu("imu.gyro_walk_rad_s2_sqrt_hz", &InertialOptions::gyro_walk_rad_s2_sqrt_hz,
           &ImuNoise::gyro_walk_rad_s2_sqrt_hz);
  take_imu("imu.accel_noise_m_s2_sqrt_hz", &InertialOptions::accel_noise_m_s2_sqrt_hz,
           &ImuNoise::accel_noise_m_s2_sqrt_hz);
  take_imu("imu.accel_bias_m_s2", &InertialOptions::accel_bias_m_s2, &ImuNoise::accel_bias_m_s2);
  take_imu("imu.accel_walk_m_s3_sqrt_hz", &InertialOptions::accel_walk_m_s3_sqrt_hz,
           &ImuNoise::accel_walk_m_s3_sqrt_hz);
  take("compass.offset_walk_rad_sqrt_hz", options.compass.offset_walk_rad_sqrt_hz,
       defaults.compass.offset_walk_rad_sqrt_hz, stated.compass.offset_walk_rad_sqrt_hz);
  take("inclinometer.bias_rad", options.inclinometer.bias_rad, defaults.inclinometer.bias_rad,
       stated.inclinometer.bias_rad);
  take("inclinometer.bias_walk_rad_sqrt_hz", options.inclinometer.bias_walk_rad_sqrt_hz,
       defaults.inclinometer.bias_walk_rad_sqrt_hz, stated.inclinometer.bias_walk_rad_sqrt_hz);
  return options;
}

}  // namespace spartan
