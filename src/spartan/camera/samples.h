// Stereo frames and sensor samples with their time stamps.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "spartan/core/frame_image.h"
#include "spartan/core/options.h"
#include "spartan/core/time.h"

namespace spartan {

/// IMU noise model as identified from an Allan deviation: white noise by its density; bias by its initial standard
/// deviation and its random walk.
struct ImuNoise {
  double gyro_noise_rad_s_sqrt_hz = 0;  ///< white noise density of the angular rate, rad/s/√Hz
  double gyro_bias_rad_s = 0;           ///< standard deviation of the initial gyroscope bias, rad/s
  double gyro_walk_rad_s2_sqrt_hz = 0;  ///< random walk of the gyroscope bias, rad/s²/√Hz
  double accel_noise_m_s2_sqrt_hz = 0;  ///< white noise density of the specific force, m/s²/√Hz
  double accel_bias_m_s2 = 0;           ///< standard deviation of the initial accelerometer bias, m/s²
  double accel_walk_m_s3_sqrt_hz = 0;   ///< random walk of the accelerometer bias, m/s³/√Hz

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("gyro_noise_rad_s_sqrt_hz", gyro_noise_rad_s_sqrt_hz,
            "White noise density of the gyroscope in rad/s/√Hz; 0 means unknown.", between(0, 1));
    v.field("gyro_bias_rad_s", gyro_bias_rad_s,
            "Standard deviation of the initial gyroscope bias in rad/s; 0 means unknown.", between(0, 1));
    v.field("gyro_walk_rad_s2_sqrt_hz", gyro_walk_rad_s2_sqrt_hz,
            "Random walk of the gyroscope bias in rad/s²/√Hz; 0 means unknown.", between(0, 1));
    v.field("accel_noise_m_s2_sqrt_hz", accel_noise_m_s2_sqrt_hz,
            "White noise density of the accelerometer in m/s²/√Hz; 0 means unknown.", between(0, 10));
    v.field("accel_bias_m_s2", accel_bias_m_s2,
            "Standard deviation of the initial accelerometer bias in m/s²; 0 means unknown.", between(0, 10));
    v.field("accel_walk_m_s3_sqrt_hz", accel_walk_m_s3_sqrt_hz,
            "Random walk of the accelerometer bias in m/s³/√Hz; 0 means unknown.", between(0, 10));
  }
};

/// Compass errors in addition to the standard deviation of each sample.
struct CompassNoise {
  double offset_walk_rad_sqrt_hz = 0;  ///< random walk of the heading offset, rad/s/√Hz

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("offset_walk_rad_sqrt_hz", offset_walk_rad_sqrt_hz,
            "Random walk of the compass offset in rad/s/√Hz; 0 means unknown.", between(0, 1));
  }
};

/// Inclinometer errors in addition to the standard deviation of each sample.
struct InclinometerNoise {
  double bias_rad = 0;               ///< standard deviation of the initial bias, rad
  double bias_walk_rad_sqrt_hz = 0;  ///< random walk of the bias, rad/s/√Hz

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("bias_rad", bias_rad, "Standard deviation of the initial inclinometer bias in rad; 0 means unknown.",
            between(0, 1));
    v.field("bias_walk_rad_sqrt_hz", bias_walk_rad_sqrt_hz,
            "Random walk of the inclinometer bias in rad/s/√Hz; 0 means unknown.", between(0, 1));
  }
};

/// Specified noise of all sensors of a recording.
struct SensorNoise {
  ImuNoise imu;
  CompassNoise compass;
  InclinometerNoise inclinometer;
};

/// One synchronous capture of a stereo pair. The images may borrow memory that the caller keeps (see FrameImage). An
/// image without pixels is missing (MissingFrame::partial).
struct StereoFrame {
  std::int64_t frame_id = 0;
  std::int64_t position_id = -1;  ///< id of the stop, shared by its frames; −1: unknown
  std::string pair;               ///< name of the stereo pair in the rig
  Stamp left_stamp, right_stamp;  ///< mid-exposure
  FrameImage left, right;
  double pan_rad = 0, tilt_rad = 0;  ///< of the mast
  double exposure_us = 0, gain = 0;  ///< 0: unknown
};

/// Identifies one stereo frame of a stream.
struct FrameKey {
  std::string pair;
  Stamp left_stamp;
};

/// Angular rate and specific force in the body frame.
struct ImuSample {
  Stamp stamp;
  Eigen::Vector3d gyro_rad_s = Eigen::Vector3d::Zero();  ///< body frame
  Eigen::Vector3d accel_m_s2 = Eigen::Vector3d::Zero();  ///< specific force, body frame; points up at rest
};

/// Odometer: accumulated rolled distance of the left and right wheels since the start.
struct WheelSample {
  Stamp stamp;
  double left_m = 0, right_m = 0;
};

/// Heading of the body x axis, counter-clockwise from east, with its standard deviation.
struct CompassSample {
  Stamp stamp;
  double heading_rad = 0, sigma_rad = 0;
};

/// Roll and pitch of the body, with their standard deviation.
struct InclinometerSample {
  Stamp stamp;
  double roll_rad = 0, pitch_rad = 0, sigma_rad = 0;
};

/// Why a frame cannot be delivered or is not processed.
enum class FrameFault {
  left_missing,    ///< the left image is missing
  right_missing,   ///< the right image is missing
  unreadable,      ///< an image cannot be decoded
  wrong_size,      ///< an image does not fit the rig
  stamp_reversed,  ///< the stamp is not after the one before
  stamps_apart,    ///< left and right stamp differ too much
  frozen,          ///< an image equals the previous one of its camera, bit for bit
  dropped,         ///< too many images of a live stream waited to be processed
};

/// The key under `skipped` in summary.json, e.g. "left_missing".
std::string_view name_of(FrameFault fault);

/// Placeholder in the stream for a listed frame that cannot be delivered.
struct MissingFrame {
  std::int64_t frame_id = 0;
  std::string pair;
  Stamp stamp;
  FrameFault fault = FrameFault::unreadable;
  std::string message;                 ///< file and cause
  std::optional<StereoFrame> partial;  ///< the frame with one image, where the other one alone is at fault
};

using Sample = std::variant<StereoFrame, ImuSample, WheelSample, CompassSample, InclinometerSample, MissingFrame>;

/// The stamp by which samples are ordered; for a stereo frame the left one.
Stamp stamp_of(const Sample& sample);
/// What a sample is one of: the name of the pair, or "imu", "wheels", "compass" or "inclinometer" with a leading colon,
/// which no name of a pair has.
std::string source_of(const Sample& sample);
/// Of the images of a sample, one that is alone included.
std::size_t image_bytes(const Sample& sample);
/// Adds a time to all stamps of a sample.
void move_stamps(Sample& sample, std::int64_t by_ns);

}  // namespace spartan
