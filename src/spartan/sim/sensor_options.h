// Options of a scenario (scenario.yaml): cameras, motion sensors and their faults, one struct per group of keys.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "spartan/core/options.h"

namespace spartan::sim {

// --- Cameras ---

/// Image sensor, lens and exposure rule, the same for all cameras of the rig.
struct SensorOptions {
  double pixel_um = 5.5;              ///< µm; pixel pitch
  double f_number = 2.0;              ///< focal length over aperture
  double transmission = 0.9;          ///< of the lens
  double vignetting = 0.7;            ///< exponent applied to cos⁴ of the field angle
  double quantum_efficiency = 0.5;    ///< electrons per photon
  double full_well_e = 15000;         ///< e⁻
  double read_noise_e = 15;           ///< e⁻; standard deviation
  double black_level = 1.0 / 64;      ///< fraction of full scale
  double target_level = 0.45;         ///< fraction of the full well
  double longest_exposure_ms = 20;    ///< ms
  double largest_gain = 16;           ///< 1: the full well is full scale
  int noise_seed = 0;                 ///< seed of the image noise alone
  double pixel_response_percent = 0;  ///< %; fixed pattern: standard deviation of the response of pixels
  double dark_offset_e = 0;           ///< e⁻; fixed pattern: standard deviation of the level without light
  double row_noise_e = 0;             ///< e⁻; standard deviation of the noise that a row has in common
  double hot_pixel_fraction = 0;      ///< pixels with 0.1 to 1 full wells without light
  double delay_ms = 0;                ///< ms; of the exposure after the stamp, all cameras
  double right_delay_ms = 0;          ///< ms; the same, right cameras in addition
  double rolling_shutter_ms = 0;      ///< ms; from the exposure of the first row to that of the last; 0: all at once
  bool meter_lags = false;            ///< auto exposure uses the frame before
  int jpeg_quality = 0;               ///< 1 to 100; 0: lossless
  double wavelet_bits = 0;            ///< per pixel, compressed by wavelets (JPEG 2000, as ICER); 0: lossless
  bool vignetting_stated = false;     ///< the recorded rig states the vignetting

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("pixel_um", pixel_um, "Pixel pitch of the image sensor in micrometres; larger pixels collect more light.",
            between(0.5, 50));
    v.field("f_number", f_number, "F-number of the lens; raising it makes images darker.", between(0.7, 32));
    v.field("transmission", transmission, "Fraction of the light that the lens transmits.", between(0.05, 1));
    v.field("vignetting", vignetting,
            "Exponent of the vignetting, applied to cos^4 of the field angle: 0 is none, 1 is natural vignetting.",
            between(0, 3));
    v.field("quantum_efficiency", quantum_efficiency, "Electrons per photon.", between(0.01, 1));
    v.field("full_well_e", full_well_e, "Full-well capacity of a pixel in electrons.", between(500, 200000));
    v.field("read_noise_e", read_noise_e, "Standard deviation of the read noise in electrons.", between(0, 500));
    v.field("black_level", black_level, "Gray level without light, as a fraction of full scale.", between(0, 0.25));
    v.field("target_level", target_level,
            "Mean signal that auto exposure aims at, as a fraction of the full well; raising it gives brighter images.",
            between(0.01, 0.9));
    v.field("longest_exposure_ms", longest_exposure_ms,
            "Longest exposure time in milliseconds; auto exposure raises the gain beyond it. Raising it reduces noise "
            "and adds motion blur.",
            between(0.01, 10000));
    v.field("largest_gain", largest_gain,
            "Largest gain of auto exposure; with a gain of 1 the full well is full scale.", between(1, 1000));
    v.field("noise_seed", noise_seed,
            "Seed of the image noise alone; another one gives the same world and drive with other noise.", at_least(0));
    v.field("pixel_response_percent", pixel_response_percent,
            "Standard deviation of the response of single pixels in percent (fixed pattern).", between(0, 50));
    v.field("dark_offset_e", dark_offset_e,
            "Standard deviation of the level of single pixels without light in electrons (fixed pattern).",
            between(0, 5000));
    v.field("row_noise_e", row_noise_e,
            "Standard deviation in electrons of the noise that all pixels of a row of one image have in common.",
            between(0, 5000));
    v.field("hot_pixel_fraction", hot_pixel_fraction,
            "Fraction of the pixels that show 0.1 to 1 full wells without light.", between(0, 0.1));
    v.field("delay_ms", delay_ms, "Delay of the exposure of all cameras after the time stamp in milliseconds.",
            between(-1000, 1000));
    v.field("right_delay_ms", right_delay_ms,
            "Delay of the exposure of the right cameras after that of the left ones in milliseconds.",
            between(-1000, 1000));
    v.field("meter_lags", meter_lags, "Whether auto exposure uses the light of the previous frame of the pair.");
    v.field("jpeg_quality", jpeg_quality,
            "Quality of the JPEG compression of the images, 1 to 100, for cameras of 8-bit gray; 0 is lossless.",
            between(0, 100));
    v.field("wavelet_bits", wavelet_bits,
            "Bits per pixel of images of 8-bit gray that are compressed by wavelets (JPEG 2000, similar to ICER), "
            "instead of by JPEG; 0 is lossless.",
            between(0, 8));
    v.field("rolling_shutter_ms", rolling_shutter_ms,
            "Time in milliseconds from the exposure of the first row to that of the last one, whose middle is the "
            "stamp; 0 exposes all rows at once.",
            between(0, 1000));
    v.field("vignetting_stated", vignetting_stated,
            "Whether the recorded rig states the vignetting, so that it is corrected.");
  }
};

/// Difference between the nominal rig, which the recording states, and the true one. Errors are those of the right
/// camera relative to the left one, except for the focal length, which is wrong in both.
struct NominalRigOptions {
  double yaw_deg = 0;        ///< deg; right camera about its y axis
  double row_offset_px = 0;  ///< px; principal point of the right camera
  double focal_percent = 0;  ///< %; both cameras

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("yaw_deg", yaw_deg,
            "Rotation error of the right camera about its y axis in the nominal calibration, in degrees.",
            between(-5, 5));
    v.renamed("rows_px", "row_offset_px");
    v.field("row_offset_px", row_offset_px,
            "Error of the right camera's principal point in rows in the nominal calibration, in pixels.",
            between(-50, 50));
    v.field("focal_percent", focal_percent, "Error of both focal lengths in the nominal calibration, in percent.",
            between(-20, 20));
  }
  friend bool operator==(const NominalRigOptions&, const NominalRigOptions&) = default;
};

/// How well the rover is built and calibrated: standard deviations of RoverErrorOptions (docs/reference/scenario.md).
enum class RoverGrade { exact, ordinary, poor };
constexpr auto enum_names(RoverGrade) {
  using enum RoverGrade;
  return std::array{EnumName{exact, "exact"}, EnumName{ordinary, "ordinary"}, EnumName{poor, "poor"}};
}

/// Standard deviations of the differences between the true rover and its calibration. One normal draw of each belongs
/// to a drive (per pair, camera or mount), except for the noise of the pan-tilt unit. The recording states the
/// calibration; truth/rig.yaml is the true rig at the start.
struct RoverErrorOptions {
  int seed = 0;                         ///< another rover on the same drive
  double pair_rotation_deg = 0;         ///< deg; right camera about each of its axes
  double baseline_percent = 0;          ///< %; length of the baseline
  double focal_percent = 0;             ///< %; both cameras of a pair together
  double focal_difference_percent = 0;  ///< %; each camera
  double centre_px = 0;                 ///< px; principal point of each camera, in x and y
  double row_offset_px = 0;             ///< px; rows of the right camera, besides centre_px
  double distortion_px = 0;             ///< px; residual radial distortion of each camera, at the image corner
  double mount_rotation_deg = 0;        ///< deg; pan-tilt unit, or pair on the body, about each axis
  double mount_mm = 0;                  ///< mm; the same along each axis
  double pan_tilt_bias_deg = 0;         ///< deg; pan and tilt, constant
  double pan_tilt_noise_deg = 0;        ///< deg; pan and tilt, at each positioning
  double drift_deg = 0;                 ///< deg; right camera about each axis, from 0 at the start to this at the end
  double gain_percent = 0;              ///< %; response of each camera to light

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("seed", seed, "Seed of these errors; another one gives another rover on the same drive.", at_least(0));
    v.field("pair_rotation_deg", pair_rotation_deg,
            "Standard deviation of the rotation of the right camera about each of its axes relative to the "
            "calibration, in degrees.",
            between(0, 5));
    v.field("baseline_percent", baseline_percent,
            "Standard deviation of the baseline length relative to the calibration, in percent.", between(0, 20));
    v.field("focal_percent", focal_percent,
            "Standard deviation of the focal length of both cameras of a pair relative to the calibration, in percent.",
            between(0, 20));
    v.field("focal_difference_percent", focal_difference_percent,
            "Standard deviation of the focal length of each camera, in addition to focal_percent, in percent.",
            between(0, 20));
    v.field("centre_px", centre_px,
            "Standard deviation of the principal point of each camera relative to the calibration, in x and y, in "
            "pixels.",
            between(0, 50));
    v.field("row_offset_px", row_offset_px,
            "Standard deviation of the rows of the right camera, in addition to centre_px, in pixels.", between(0, 50));
    v.field("distortion_px", distortion_px,
            "Standard deviation of the radial distortion that the calibration of each camera leaves, in pixels at the "
            "image corner; for pinhole and radial-tangential cameras.",
            between(0, 50));
    v.field("mount_rotation_deg", mount_rotation_deg,
            "Standard deviation of the rotation of a pan-tilt unit, or of a pair on the body, about each axis relative "
            "to the calibration, in degrees.",
            between(0, 20));
    v.field("mount_mm", mount_mm,
            "Standard deviation of the position of a pan-tilt unit, or of a pair on the body, along each axis relative "
            "to the calibration, in millimetres.",
            between(0, 200));
    v.field("pan_tilt_bias_deg", pan_tilt_bias_deg,
            "Standard deviation of the constant errors of the pan and tilt angles in degrees.", between(0, 20));
    v.field("pan_tilt_noise_deg", pan_tilt_noise_deg,
            "Standard deviation of the errors of the pan and tilt angles at each positioning in degrees.",
            between(0, 20));
    v.field("drift_deg", drift_deg,
            "Standard deviation of the rotation of the right camera about each of its axes that grows linearly from 0 "
            "at the start to its value at the end of the drive, in degrees.",
            between(0, 5));
    v.field("gain_percent", gain_percent, "Standard deviation of the response of each camera to light in percent.",
            between(0, 50));
  }
  friend bool operator==(const RoverErrorOptions&, const RoverErrorOptions&) = default;
};

/// The standard deviations of a grade.
RoverErrorOptions rover_errors(RoverGrade grade);
/// The quality of JPEG images of a grade, as SensorOptions::jpeg_quality.
int jpeg_quality(RoverGrade grade);

enum class CameraFaultKind {
  dropped,
  left_dark,
  right_dark,
  overexposed,
  left_dust,
  right_dust,
  brightness_step,
  stamp_jitter
};
constexpr auto enum_names(CameraFaultKind) {
  using enum CameraFaultKind;
  return std::array{EnumName{dropped, "dropped"},
                    EnumName{left_dark, "left_dark"},
                    EnumName{right_dark, "right_dark"},
                    EnumName{overexposed, "overexposed"},
                    EnumName{left_dust, "left_dust"},
                    EnumName{right_dust, "right_dust"},
                    EnumName{brightness_step, "brightness_step"},
                    EnumName{stamp_jitter, "stamp_jitter"}};
}

/// A fault of a pair's cameras during an interval.
struct CameraFault {
  CameraFaultKind kind = CameraFaultKind::dropped;
  std::string pair;             ///< empty: all pairs
  double from_s = 0, to_s = 0;  ///< s since the start of the recording
  double amount = 0;            ///< by kind: factor on the light, or standard deviation in s

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("kind", kind,
            "Kind of fault: frames dropped, left or right camera dark, both overexposed, dust on the left or right "
            "lens, a step of brightness, or jitter of the time stamps.");
    v.field("pair", pair, "Name of the pair that fails; empty for all pairs.");
    v.field("from_s", from_s, "Start of the fault in seconds since the start of the recording.", at_least(0));
    v.field("to_s", to_s, "End of the fault in seconds since the start of the recording.", at_least(0));
    v.check("to_s", to_s > from_s, "must be greater than from_s");
    v.field("amount", amount,
            "Size of the fault: for overexposed and brightness_step the factor on the light that auto exposure does "
            "not see; for stamp_jitter the standard deviation of the time stamps in seconds.",
            at_least(0));
  }
};
using CameraFaults = std::vector<CameraFault>;

// --- Motion sensors ---

/// Noise and errors of typical IMUs (docs/reference/scenario.md); `given`: those of the keys.
enum class ImuGrade { given, tactical, industrial, mems };
constexpr auto enum_names(ImuGrade) {
  using enum ImuGrade;
  return std::array{EnumName{given, "given"}, EnumName{tactical, "tactical"}, EnumName{industrial, "industrial"},
                    EnumName{mems, "mems"}};
}

/// Errors as from an Allan deviation: white noise by its density, the bias as a constant of the drive plus a random
/// walk. Scale errors and misalignment of the axes are constants of the drive.
struct ImuOptions {
  bool enabled = true;
  ImuGrade grade = ImuGrade::given;
  double rate_hz = 100;                    ///< Hz
  double gyro_noise_rad_s_sqrt_hz = 1e-4;  ///< rad/s/√Hz
  double gyro_bias_rad_s = 5e-5;           ///< rad/s; standard deviation at the start
  double gyro_walk_rad_s2_sqrt_hz = 2e-6;  ///< rad/s²/√Hz
  double accel_noise_m_s2_sqrt_hz = 1e-3;  ///< m/s²/√Hz
  double accel_bias_m_s2 = 5e-3;           ///< m/s²; standard deviation at the start
  double accel_walk_m_s3_sqrt_hz = 5e-5;   ///< m/s³/√Hz
  double scale_percent = 0;                ///< %; standard deviation of the scale of each axis
  double misalignment_deg = 0;             ///< deg; standard deviation of the angles between the axes
  double gyro_step_rad_s = 0;              ///< rad/s; quantization
  double accel_step_m_s2 = 0;              ///< m/s²; quantization
  double gyro_vibration_rad_m = 0;         ///< rad/s per m/s; standard deviation of white noise while driving
  double accel_vibration_1_s = 0;          ///< m/s² per m/s; the same
  double delay_ms = 0;                     ///< ms; of the stamp after the measurement
  std::vector<double> position_m = {};     ///< m; body; the recording does not state it. Empty: the origin

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled, "Whether the rover has an IMU.");
    v.field("grade", grade, "Typical IMU whose noise and errors the keys below have where they are not given.");
    v.field("rate_hz", rate_hz, "Samples per second.", between(1, 2000));
    v.field("gyro_noise_rad_s_sqrt_hz", gyro_noise_rad_s_sqrt_hz,
            "Density of the gyroscopes' white noise in rad/s/sqrt(Hz).", between(0, 1));
    v.field("gyro_bias_rad_s", gyro_bias_rad_s, "Standard deviation of the gyroscopes' bias at the start in rad/s.",
            between(0, 1));
    v.field("gyro_walk_rad_s2_sqrt_hz", gyro_walk_rad_s2_sqrt_hz,
            "Density of the random walk of the gyroscopes' bias in rad/s^2/sqrt(Hz).", between(0, 1));
    v.field("accel_noise_m_s2_sqrt_hz", accel_noise_m_s2_sqrt_hz,
            "Density of the accelerometers' white noise in m/s^2/sqrt(Hz).", between(0, 10));
    v.field("accel_bias_m_s2", accel_bias_m_s2, "Standard deviation of the accelerometers' bias at the start in m/s^2.",
            between(0, 10));
    v.field("accel_walk_m_s3_sqrt_hz", accel_walk_m_s3_sqrt_hz,
            "Density of the random walk of the accelerometers' bias in m/s^3/sqrt(Hz).", between(0, 10));
    v.field("scale_percent", scale_percent, "Standard deviation of the scale errors of the axes in percent.",
            between(0, 20));
    v.field("misalignment_deg", misalignment_deg,
            "Standard deviation of the angles by which axes are tilted towards each other, in degrees.",
            between(0, 10));
    v.field("gyro_step_rad_s", gyro_step_rad_s, "Resolution of the gyroscopes in rad/s; 0 is exact.", between(0, 1));
    v.field("accel_step_m_s2", accel_step_m_s2, "Resolution of the accelerometers in m/s^2; 0 is exact.",
            between(0, 10));
    v.field("gyro_vibration_rad_m", gyro_vibration_rad_m,
            "Standard deviation of the gyroscopes' vibration in rad/s for each m/s of driving speed.", between(0, 100));
    v.field("accel_vibration_1_s", accel_vibration_1_s,
            "Standard deviation of the accelerometers' vibration in m/s^2 for each m/s of driving speed.",
            between(0, 1000));
    v.field("delay_ms", delay_ms, "Time in milliseconds by which the stamps are later than the measurements.",
            between(-1000, 1000));
    v.field("position_m", position_m,
            "Position x, y, z of the IMU in the body frame in metres, which the recording does not state; empty for "
            "the origin.");
    v.check("position_m", position_m.empty() || position_m.size() == 3, "must have three values");
  }
};

/// The noise and errors of a grade; `given`: the defaults.
ImuOptions imu_of_grade(ImuGrade grade);

/// Wheel odometry with slip, the fraction of the rolled distance that does not move the rover:
///   slip = level + by_slope · tan(climb) + sand · noise(x, y),  rolled = travelled / (1 − slip).
/// Side slip and creep move the body, whether or not it has encoders: the rover follows its path with its heading
/// turned uphill by atan(side_slip · tan(cross slope)), and slides downhill at creep · tan(slope) while it stands.
struct WheelOptions {
  bool enabled = true;
  double rate_hz = 20;           ///< Hz
  double slip_level = 0.02;      ///< slip on level ground
  double slip_by_slope = 1;      ///< slip per tan(climb)
  double slip_sand = 0.03;       ///< standard deviation of the slip between patches of sand
  double sand_size_m = 2;        ///< m; size of the patches
  double turn_skid = 0;          ///< rolled by turns more than without skid, as a fraction
  double side_slip = 0;          ///< lateral slip per tan(cross slope)
  double creep_m_s = 0;          ///< m/s per tan(slope)
  double radius_error = 0.005;   ///< standard deviation of each side's scale
  double resolution_m = 0.0005;  ///< m; encoder step

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled, "Whether the rover has wheel encoders.");
    v.field("rate_hz", rate_hz, "Samples per second.", between(0.1, 1000));
    v.field("slip_level", slip_level, "Slip on level ground, as a fraction of the rolled distance.",
            between(-0.5, 0.9));
    v.field("slip_by_slope", slip_by_slope, "Additional slip on a climb of 45 degrees; it grows with tan(climb).",
            between(0, 5));
    v.field("slip_sand", slip_sand, "Standard deviation of the slip between patches of sand.", between(0, 0.5));
    v.field("sand_size_m", sand_size_m, "Size of the patches of sand in metres.", between(0.1, 100));
    v.field("turn_skid", turn_skid,
            "Fraction of the difference between left and right wheels that they roll more in turns, as they skid.",
            between(0, 2));
    v.field(
        "side_slip", side_slip,
        "Lateral slip over the distance on a cross slope of 45 degrees; the rover heads uphill to stay on its path.",
        between(0, 2));
    v.field("creep_m_s", creep_m_s,
            "Downhill speed in metres per second at which the rover slides on a slope of 45 degrees while it stands.",
            between(0, 0.1));
    v.field("radius_error", radius_error,
            "Standard deviation of the scale error of each side, as a fraction of the distance.", between(0, 0.2));
    v.field("resolution_m", resolution_m, "Resolution of the encoders in metres of rolled distance; 0 is exact.",
            between(0, 0.1));
  }
};

/// A compass or sun sensor.
struct CompassOptions {
  bool enabled = true;
  double rate_hz = 1;              ///< Hz
  double sigma_deg = 1;            ///< deg; standard deviation of the noise
  double bias_deg = 1;             ///< deg; standard deviation of the bias
  double outlier_fraction = 0.02;  ///< fraction of samples with a random heading

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled, "Whether the rover has a compass.");
    v.field("rate_hz", rate_hz, "Samples per second.", between(0.01, 100));
    v.field("sigma_deg", sigma_deg, "Standard deviation of the noise of a sample in degrees, as recorded with it.",
            between(0, 90));
    v.field("bias_deg", bias_deg, "Standard deviation in degrees of the bias, which is constant over the drive.",
            between(0, 90));
    v.renamed("outlier_share", "outlier_fraction");
    v.field("outlier_fraction", outlier_fraction, "Fraction of samples whose heading is uniformly random.",
            between(0, 1));
  }
};

/// An inclinometer for roll and pitch.
struct InclinometerOptions {
  bool enabled = true;
  double rate_hz = 5;      ///< Hz
  double sigma_deg = 0.2;  ///< deg; standard deviation of the noise
  double bias_deg = 0.1;   ///< deg; standard deviation of the bias

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("enabled", enabled, "Whether the rover has an inclinometer.");
    v.field("rate_hz", rate_hz, "Samples per second.", between(0.01, 1000));
    v.field("sigma_deg", sigma_deg, "Standard deviation of the noise of a sample in degrees, as recorded with it.",
            between(0, 45));
    v.field("bias_deg", bias_deg,
            "Standard deviation in degrees of the biases of roll and pitch, which are constant over the drive.",
            between(0, 45));
  }
};

enum class MotionSensor { imu, wheels, compass, inclinometer };
constexpr auto enum_names(MotionSensor) {
  using enum MotionSensor;
  return std::array{EnumName{imu, "imu"}, EnumName{wheels, "wheels"}, EnumName{compass, "compass"},
                    EnumName{inclinometer, "inclinometer"}};
}

enum class SensorFaultKind { drop, freeze };
constexpr auto enum_names(SensorFaultKind) {
  return std::array{EnumName{SensorFaultKind::drop, "drop"}, EnumName{SensorFaultKind::freeze, "freeze"}};
}

/// An interval in which a sensor sends nothing, or repeats its last sample.
struct SensorFault {
  MotionSensor sensor = MotionSensor::imu;
  SensorFaultKind kind = SensorFaultKind::drop;
  double from_s = 0, to_s = 0;  ///< s since the start of the recording

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("sensor", sensor, "Sensor that fails.");
    v.field("kind", kind, "Kind of fault: drop sends no samples, freeze repeats the last one.");
    v.field("from_s", from_s, "Start of the fault in seconds since the start of the recording.", at_least(0));
    v.field("to_s", to_s, "End of the fault in seconds since the start of the recording.", at_least(0));
    v.check("to_s", to_s > from_s, "must be greater than from_s");
  }
};
using SensorFaults = std::vector<SensorFault>;

}  // namespace spartan::sim
