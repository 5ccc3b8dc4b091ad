// Options of the localization. One set of defaults serves all recordings.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "spartan/camera/samples.h"
#include "spartan/core/options.h"

namespace spartan {

/// Noise of the IMU as of an Allan deviation: white noise by density, biases by their initial standard deviation and a
/// random walk.
struct InertialOptions {
  /// Position of the IMU on the body, and stamp of the IMU minus stamp of the cameras: of the rig file (Rig::imu).
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  double time_offset_s = 0;
  double time_offset_sigma_s = 0.01;         ///< s, standard deviation of the clock of the IMU around that; 0: exact
  double gyro_noise_rad_s_sqrt_hz = 1.2e-4;  ///< rad/s/√Hz, white noise of the gyro
  double gyro_bias_sigma_rad_s = 0.05;       ///< rad/s, initial standard deviation of the gyro bias
  double gyro_walk_rad_s2_sqrt_hz = 2e-5;    ///< rad/s²/√Hz, random walk of the gyro bias
  double accel_noise_m_s2_sqrt_hz = 1.5e-3;  ///< m/s²/√Hz, white noise of the accelerometer
  double accel_bias_sigma_m_s2 = 0.3;        ///< m/s², initial standard deviation of the accelerometer bias
  double accel_walk_m_s3_sqrt_hz = 1e-3;     ///< m/s³/√Hz, random walk of the accelerometer bias
  double accel_scale_sigma = 0.004;          ///< standard deviation of measured over true gravity
  double timeout_s = 0.25;                   ///< s, longest gap that is integrated over
  double frozen_s = 0.5;                     ///< s, identical readings for this long exclude the IMU
  double alignment_s = 1.0;                  ///< s, least length of the motions that align an IMU
  double stationary_gyro_rad_s = 0.004;      ///< rad/s, threshold on standard deviation and mean of a stationary gyro
  double stationary_accel_m_s2 = 0.03;  ///< m/s², threshold on the standard deviation of a stationary accelerometer

  /// Largest error of the clock that can be estimated: readings with stamps up to this far ahead are waited for.
  double max_time_error_s() const;

  /// Largest standard deviations of the readings of a stationary rover, `interval_s` apart.
  double stationary_gyro(double interval_s) const;
  double stationary_accel(double interval_s) const;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field(
        "gyro_noise_rad_s_sqrt_hz", gyro_noise_rad_s_sqrt_hz,
        "White noise density of the gyro, in rad/s/sqrt(Hz); raising it makes the attitude follow vision more and the "
        "gyro less.",
        between(1e-8, 1));
    v.renamed("gyro_bias_rad_s", "gyro_bias_sigma_rad_s");
    v.field("gyro_bias_sigma_rad_s", gyro_bias_sigma_rad_s,
            "Standard deviation of the gyro bias at the start, in rad/s; raising it lets the first seconds estimate a "
            "larger bias.",
            between(0, 1));
    v.field("gyro_walk_rad_s2_sqrt_hz", gyro_walk_rad_s2_sqrt_hz,
            "Random walk of the gyro bias, in rad/s^2/sqrt(Hz); raising it lets the estimated bias change faster.",
            between(0, 1));
    v.field(
        "accel_noise_m_s2_sqrt_hz", accel_noise_m_s2_sqrt_hz,
        "White noise density of the accelerometer, in m/s^2/sqrt(Hz); raising it makes velocity and tilt follow the "
        "other sensors more.",
        between(1e-8, 10));
    v.renamed("accel_bias_m_s2", "accel_bias_sigma_m_s2");
    v.field("accel_bias_sigma_m_s2", accel_bias_sigma_m_s2,
            "Standard deviation of the accelerometer bias at the start, in m/s^2; raising it makes the direction of "
            "gravity less certain.",
            between(0, 10));
    v.field(
        "accel_walk_m_s3_sqrt_hz", accel_walk_m_s3_sqrt_hz,
        "Random walk of the accelerometer bias, in m/s^3/sqrt(Hz); raising it lets the estimated bias change faster.",
        between(0, 10));
    v.field(
        "accel_scale_sigma", accel_scale_sigma,
        "Standard deviation of the accelerometer's scale (and of the stated gravity), as a fraction; raising it lets "
        "the measured size of gravity be estimated farther from the stated one.",
        between(0, 0.2));
    v.field("time_offset_sigma_s", time_offset_sigma_s,
            "Standard deviation in seconds of the difference between the clocks of IMU and cameras, around "
            "imu.time_offset_s of the rig file; errors up to three times this are estimated. 0: the clocks agree.",
            between(0, 1));
    v.field("timeout_s", timeout_s,
            "Longest gap between two IMU samples that is integrated over, in seconds; beyond it the constant-velocity "
            "model takes over.",
            between(1e-3, 10));
    v.field(
        "frozen_s", frozen_s,
        "Identical IMU readings for this many seconds exclude the IMU as frozen; raise it for sensors with a coarse "
        "resolution.",
        between(0.01, 100));
    v.renamed("level_after_s", "alignment_s");
    v.field("alignment_s", alignment_s,
            "An IMU that is not aligned at the start (no rest, or it starts during the drive) is aligned by the visual "
            "motions of at least this many seconds; raising it averages over more motions.",
            between(0.1, 100));
    v.renamed("still_gyro_rad_s", "stationary_gyro_rad_s");
    v.field("stationary_gyro_rad_s", stationary_gyro_rad_s,
            "Standard deviation and mean of the gyro rate below which the rover may be stationary, in rad/s (or twice "
            "the gyro's noise if that is more); raising it triggers zero-velocity updates more easily.",
            between(0, 1));
    v.renamed("still_accel_m_s2", "stationary_accel_m_s2");
    v.field("stationary_accel_m_s2", stationary_accel_m_s2,
            "Standard deviation of the accelerometer below which the rover may be stationary, in m/s^2 (or twice its "
            "noise if that is more); raising it triggers zero-velocity updates more easily.",
            between(0, 10));
  }
};

/// The error of a visual motion is L n + D z: white noise n of the measured covariance times `white_noise_factor`, and
/// a lasting error z in units of the measured standard deviations D, with a slowly changing and a constant part
/// (docs/math/localization.md, "Vision").
struct VisionOptions {
  double white_noise_factor = 0.57;  ///< factor on the covariance of visual motions
  /// Standard deviations of the slowly changing error (Gauss–Markov), in measured standard deviations: x, y, z, about
  /// x, y, z.
  std::vector<double> drift_sigma_ratios{0.47, 0.25, 0.47, 0.37, 0.6, 0.6};
  double drift_correlation_frames = 7;  ///< frames, correlation length of that error
  /// The same of the error that is constant over a drive.
  std::vector<double> constant_sigma_ratios{0.52, 0.55, 0.55, 0.37, 0.32, 0.4};
  double gate_probability = 0.999999;  ///< fraction of correct motions that pass the chi-square test

  template <class Visitor>
  void describe(Visitor& v) {
    v.renamed("white_factor", "white_noise_factor");
    v.field(
        "white_noise_factor", white_noise_factor,
        "Factor on the covariance of visual motions, for errors that are independent from frame to frame; raising it "
        "trusts vision less.",
        between(0.01, 1e4));
    v.renamed("drift_sigmas", "drift_sigma_ratios");
    v.field(
        "drift_sigma_ratios", drift_sigma_ratios,
        "Standard deviations of the slowly changing error of vision (a first-order Gauss-Markov process) along x, y, z "
        "and about x, y, z, as multiples of the standard deviation of a visual motion; raising them makes the "
        "covariance of the pose grow faster.",
        between(0, 1e3), Length{6});
    v.renamed("drift_steps", "drift_correlation_frames");
    v.field("drift_correlation_frames", drift_correlation_frames,
            "Correlation time of that error in frames, after which it falls to 1/e; raising it makes the error last "
            "longer.",
            between(1, 1e6));
    v.renamed("constant_sigmas", "constant_sigma_ratios");
    v.field("constant_sigma_ratios", constant_sigma_ratios,
            "Standard deviations of the error of vision that is constant over a drive, axes and unit as "
            "drift_sigma_ratios; "
            "raising them makes the covariance of the pose grow faster.",
            between(0, 1e3), Length{6});
    v.field("gate_probability", gate_probability,
            "Fraction of correct visual motions that pass the chi-square test; raising it rejects fewer motions.",
            between(0.5, 1 - 1e-12));
  }
};

struct WheelOdometryOptions {
  double track_m = 0.6;  ///< m, between left and right wheels, of the rig file (Rig::rover)
  /// m, of the rig file (Rig::turning_centre_m).
  Eigen::Vector3d turning_centre_m = Eigen::Vector3d::Zero();
  bool use_rotation = true;              ///< whether the difference of the wheels measures a rotation
  double scale_sigma = 0.1;              ///< initial standard deviation of travelled over counted distance
  double scale_walk_per_sqrt_s = 0.005;  ///< 1/√s, random walk of that scale
  double forward_sigma_ratio = 0.12;     ///< standard deviation of a step forward, over its length
  double side_sigma_ratio = 0.2;         ///< standard deviation of a step to the side, over its length
  double up_sigma_ratio = 0.3;           ///< standard deviation of a step along the body's z, over its length
  double turn_sigma_ratio = 0.3;         ///< standard deviation of a step's rotation, over that rotation
  double min_sigma_m = 0.002;            ///< m, minimum standard deviation of a step
  double max_step_s = 2.5;               ///< s, longest step
  double min_slip_distance_m = 0.02;     ///< m, shortest step that slip is reported for
  double slip_alarm = 0.4;               ///< slip beyond which the summary of a run has an alarm

  template <class Visitor>
  void describe(Visitor& v) {
    v.former("track_m", track_m, WheelOdometryOptions().track_m,
             "rover.track_m in the rig file, and localization.wheels.use_rotation", between(0, 10));
    v.field(
        "use_rotation", use_rotation,
        "True derives the rotation of the rover from the difference of the left and right wheels and their distance "
        "(rover.track_m of the rig file); false ignores it.");
    v.field(
        "scale_sigma", scale_sigma,
        "Initial standard deviation of the wheel scale factor, true over measured distance (wheel radius, mean slip); "
        "raising it lets the scale be estimated farther from 1.",
        between(0, 1));
    v.renamed("scale_walk_sqrt_hz", "scale_walk_per_sqrt_s");
    v.field("scale_walk_per_sqrt_s", scale_walk_per_sqrt_s,
            "Random walk of that scale, in 1/sqrt(s); raising it lets the scale follow changing soil faster.",
            between(0, 1));
    v.renamed("forward_share", "forward_sigma_ratio");
    v.field(
        "forward_sigma_ratio", forward_sigma_ratio,
        "Standard deviation of the distance between two updates by the wheels, as a fraction of it (slip beyond the "
        "mean); raising it trusts the "
        "wheels less and detects slip later.",
        between(0, 1));
    v.renamed("side_share", "side_sigma_ratio");
    v.field("side_sigma_ratio", side_sigma_ratio,
            "Standard deviation of motion to the side as a fraction of the distance between two updates; raising it "
            "allows more lateral "
            "slip.",
            between(0, 10));
    v.renamed("up_share", "up_sigma_ratio");
    v.field("up_sigma_ratio", up_sigma_ratio,
            "Standard deviation of motion along the body's z axis as a fraction of the distance between two updates; "
            "raising it allows "
            "for rougher ground.",
            between(0, 10));
    v.renamed("turn_share", "turn_sigma_ratio");
    v.field("turn_sigma_ratio", turn_sigma_ratio,
            "Standard deviation of the rotation between two updates as a fraction of it; raising it trusts the "
            "rotation by the wheels "
            "less.",
            between(0, 10));
    v.renamed("floor_m", "min_sigma_m");
    v.field("min_sigma_m", min_sigma_m,
            "Minimum standard deviation of the distance between two updates in metres; raising it lowers the weight of "
            "short distances.",
            between(1e-6, 1));
    v.renamed("longest_step_s", "max_step_s");
    v.field("max_step_s", max_step_s,
            "Longest interval between two updates by the wheels in seconds (a stereo frame ends one, too); raising it "
            "gives fewer updates over longer distances.",
            between(0.1, 100));
    v.field("slip_alarm", slip_alarm,
            "Slip (1 - travelled / counted) beyond which the summary of a run has an alarm; raising it reports fewer "
            "places where the wheels spin.",
            between(0, 1));
    v.renamed("least_slip_distance_m", "min_slip_distance_m");
    v.field(
        "min_slip_distance_m", min_slip_distance_m,
        "Minimum length of a step in metres for which slip is reported; raising it gives fewer but more accurate slip "
        "values.",
        between(1e-3, 10));
  }
};

struct HeadingOptions {
  double min_sigma_rad = 0.002;                ///< rad, minimum standard deviation of a reading
  double offset_sigma_rad = 0.003;             ///< rad, initial standard deviation of the offset
  double offset_walk_rad_per_sqrt_s = 1.5e-4;  ///< rad/√s, random walk of the offset

  template <class Visitor>
  void describe(Visitor& v) {
    v.renamed("least_sigma_rad", "min_sigma_rad");
    v.field("min_sigma_rad", min_sigma_rad,
            "Minimum standard deviation of a compass reading in radians, whatever the reading specifies; raising it "
            "trusts the compass less.",
            between(1e-6, 1));
    v.field(
        "offset_sigma_rad", offset_sigma_rad,
        "Initial standard deviation of the compass offset in radians, relative to the heading at the start; raising it "
        "lets the offset be estimated farther from zero.",
        between(0, 1));
    v.renamed("offset_walk_rad_sqrt_hz", "offset_walk_rad_per_sqrt_s");
    v.field("offset_walk_rad_per_sqrt_s", offset_walk_rad_per_sqrt_s,
            "Random walk of the compass offset, in rad/sqrt(s); raising it lets the offset change faster.",
            between(0, 1));
  }
};

struct TiltOptions {
  double noise_factor = 1.0;               ///< factor on the specified standard deviation of a reading
  double min_sigma_rad = 0.0005;           ///< rad, minimum standard deviation of a reading
  double bias_sigma_rad = 0.0025;          ///< rad, initial standard deviation of the bias
  double bias_walk_rad_per_sqrt_s = 1e-5;  ///< rad/√s, random walk of the bias

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("noise_factor", noise_factor,
            "Factor on the specified standard deviation of inclinometer readings; raise it for an inclinometer that is "
            "sensitive to accelerations.",
            between(0.1, 100));
    v.renamed("least_sigma_rad", "min_sigma_rad");
    v.field(
        "min_sigma_rad", min_sigma_rad,
        "Minimum standard deviation of an inclinometer reading in radians, whatever the reading specifies; raising it "
        "trusts the inclinometer less.",
        between(1e-6, 1));
    v.renamed("bias_rad", "bias_sigma_rad");
    v.field("bias_sigma_rad", bias_sigma_rad,
            "Standard deviation of the inclinometer bias at the start, in radians; raising it makes absolute tilt less "
            "certain.",
            between(0, 1));
    v.renamed("bias_walk_rad_sqrt_hz", "bias_walk_rad_per_sqrt_s");
    v.field("bias_walk_rad_per_sqrt_s", bias_walk_rad_per_sqrt_s,
            "Random walk of the inclinometer bias, in rad/sqrt(s); raising it lets the bias change faster.",
            between(0, 1));
  }
};

/// Zero-velocity updates (ZUPT).
struct ZeroVelocityOptions {
  bool enabled = true;                 ///< whether zero-velocity updates are applied
  double block_s = 0.5;                ///< s, interval of the standard deviation of the IMU
  double wheels_stationary_s = 1.0;    ///< s, minimum time without wheel motion
  double wheels_stationary_m = 0.001;  ///< m, change of a wheel count that is no motion
  double position_sigma_m = 5e-4;      ///< m, standard deviation of the position of a stationary rover
  double attitude_sigma_rad = 2e-4;    ///< rad, standard deviation of the attitude of a stationary rover

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled,
            "Apply zero-velocity updates while IMU and wheels (or, without wheels, vision) detect a stationary rover; "
            "false disables them.");
    v.field("block_s", block_s,
            "Interval over which the standard deviation of the IMU is computed, in seconds; raising it detects stops "
            "later and more "
            "reliably.",
            between(0.05, 10));
    v.renamed("wheels_still_s", "wheels_stationary_s");
    v.field(
        "wheels_stationary_s", wheels_stationary_s,
        "Minimum time without wheel motion before a zero-velocity update, in seconds; raising it detects stops later.",
        between(0, 100));
    v.renamed("wheels_still_m", "wheels_stationary_m");
    v.field(
        "wheels_stationary_m", wheels_stationary_m,
        "Change of a wheel count in metres up to which the wheel counts as stationary; raise it for coarse encoders.",
        between(0, 1));
    v.renamed("position_m", "position_sigma_m");
    v.field("position_sigma_m", position_sigma_m,
            "Standard deviation of a zero-velocity update's position in metres; raising it constrains the position "
            "less.",
            between(1e-7, 1));
    v.renamed("attitude_rad", "attitude_sigma_rad");
    v.field("attitude_sigma_rad", attitude_sigma_rad,
            "Standard deviation of a zero-velocity update's attitude in radians; raising it constrains the attitude "
            "less.",
            between(1e-8, 1));
  }
};

/// Constant-velocity model for times without an IMU: velocity and angular rate are constant in the body frame. Noise
/// densities grow with speed, so that one set of options serves a rover and a car: σ = ratio · (|v| + offset).
struct ConstantVelocityOptions {
  double speed_sigma_ratio_per_sqrt_s = 0.5;  ///< 1/√s, noise density of the velocity over the speed
  double speed_offset_m_s = 0.05;             ///< m/s, added to the speed
  double rate_sigma_ratio = 0.5;              ///< error of the last angular rate over that rate
  double rate_offset_rad_s = 0.008;           ///< rad/s, added to the rate

  template <class Visitor>
  void describe(Visitor& v) {
    v.renamed("speed_share_sqrt_hz", "speed_sigma_ratio_per_sqrt_s");
    v.field("speed_sigma_ratio_per_sqrt_s", speed_sigma_ratio_per_sqrt_s,
            "Noise density of the velocity as a fraction of the speed, in 1/sqrt(s); raising it makes predictions "
            "without an IMU less certain.",
            between(0, 100));
    v.renamed("speed_floor_m_s", "speed_offset_m_s");
    v.field("speed_offset_m_s", speed_offset_m_s,
            "Speed in m/s that is added before speed_sigma_ratio_per_sqrt_s applies; raising it makes predictions at "
            "low speed "
            "less certain.",
            between(0, 100));
    v.renamed("turn_share", "rate_sigma_ratio");
    v.field("rate_sigma_ratio", rate_sigma_ratio,
            "Error of the last angular rate as a fraction of it; raising it makes the predicted attitude less certain.",
            between(0, 100));
    v.renamed("turn_floor_rad_s", "rate_offset_rad_s");
    v.field(
        "rate_offset_rad_s", rate_offset_rad_s,
        "Angular rate in rad/s that is added before rate_sigma_ratio applies; raise it for a rover that pitches and "
        "rolls more.",
        between(0, 100));
  }
};

/// Gating and timeouts of the sensors.
struct HealthOptions {
  double gate_probability = 0.999;    ///< fraction of correct samples that pass the chi-square tests
  int excluded_after = 3;             ///< consecutive rejections that exclude a sensor
  int readmit_after = 5;              ///< consecutive consistent samples that readmit it
  double vision_timeout_s = 10;       ///< s
  double wheels_timeout_s = 2;        ///< s
  double compass_timeout_s = 10;      ///< s
  double inclinometer_timeout_s = 5;  ///< s

  template <class Visitor>
  void describe(Visitor& v) {
    v.field(
        "gate_probability", gate_probability,
        "Fraction of correct samples that pass the chi-square tests of wheels, compass, inclinometer and map; raising "
        "it rejects fewer samples.",
        between(0.5, 1 - 1e-12));
    v.field("excluded_after", excluded_after,
            "Number of consecutive rejections that exclude a sensor; raising it tolerates longer runs of outliers.",
            between(1, 1000));
    v.renamed("back_after", "readmit_after");
    v.field("readmit_after", readmit_after,
            "Number of consecutive consistent samples that readmit an excluded sensor; raising it readmits later.",
            between(1, 1000));
    v.field(
        "vision_timeout_s", vision_timeout_s,
        "Seconds without visual motions after which vision is reported as missing; raising it reports outages later.",
        between(0.01, 1e4));
    v.field(
        "wheels_timeout_s", wheels_timeout_s,
        "Seconds without samples after which the wheels are reported as missing and no longer needed for zero-velocity "
        "updates.",
        between(0.01, 1e4));
    v.field("compass_timeout_s", compass_timeout_s,
            "Seconds without samples after which the compass is reported as missing; raising it reports outages later.",
            between(0.01, 1e4));
    v.field("inclinometer_timeout_s", inclinometer_timeout_s,
            "Seconds without samples after which the inclinometer is reported as missing; raising it reports outages "
            "later.",
            between(0.01, 1e4));
  }
};

struct LocalizationOptions {
  double gravity_m_s2 = 9.81;  ///< m/s², of the planet; not in files: the creator of a Localizer sets it
  double buffer_s = 15;        ///< s, samples that arrive later are refused
  double map_factor = 1;       ///< factor on the covariance of map constraints
  InertialOptions imu;
  VisionOptions vision;
  WheelOdometryOptions wheels;
  HeadingOptions compass;
  TiltOptions inclinometer;
  ZeroVelocityOptions zero_velocity;
  ConstantVelocityOptions constant_velocity;
  HealthOptions health;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field(
        "buffer_s", buffer_s,
        "Samples that arrive more than this many seconds late are discarded; raising it costs memory and the time to "
        "replay.",
        between(0, 600));
    v.field("map_factor", map_factor, "Factor on the covariance of map constraints; raising it trusts the map less.",
            between(0.01, 1e4));
    v.group("imu", imu);
    v.group("vision", vision);
    v.group("wheels", wheels);
    v.group("compass", compass);
    v.group("inclinometer", inclinometer);
    v.renamed("standing", "zero_velocity");
    v.group("zero_velocity", zero_velocity);
    v.renamed("unmeasured", "constant_velocity");
    v.group("constant_velocity", constant_velocity);
    v.group("health", health);
  }
};

/// Replaces defaults by the noise that a recording specifies for its sensors. Kept are values whose keys were given (in
/// a config file or with --set; `given` holds keys of LocalizationOptions), even where they are the default, and values
/// that differ from the default (set in code).
LocalizationOptions with_specified_noise(LocalizationOptions options, const SensorNoise& specified,
                                         const GivenKeys& given = {});

}  // namespace spartan
