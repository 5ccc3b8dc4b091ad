// Stereo frames and sensor samples with their time stamps.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <variant>

#include "spartan/core/frame_image.h"
#include "spartan/core/time.h"

namespace spartan {

/// One synchronous capture of a stereo pair. The images may borrow memory that the caller keeps (see FrameImage).
struct StereoFrame {
  std::int64_t frame_id = 0;
  std::int64_t position_id = -1;  ///< id of the stop, shared by its frames; −1: unknown
  std::string pair;               ///< name of the stereo pair in the rig
  Stamp left_stamp, right_stamp;  ///< mid-exposure
  FrameImage left, right;
  double pan_rad = 0, tilt_rad = 0;  ///< of the mast
  double exposure_us = 0, gain = 0;  ///< 0: unknown
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

/// Why a listed frame cannot be delivered.
enum class FrameFault { left_missing, right_missing, unreadable, wrong_size, stamp_reversed, stamps_apart };

/// The key under `skipped` in summary.json, e.g. "left_missing".
std::string_view name_of(FrameFault fault);

/// Placeholder in the stream for a listed frame that cannot be delivered.
struct MissingFrame {
  std::int64_t frame_id = 0;
  std::string pair;
  Stamp stamp;
  FrameFault fault = FrameFault::unreadable;
  std::string message;  ///< file and cause
};

using Sample = std::variant<StereoFrame, ImuSample, WheelSample, CompassSample, InclinometerSample, MissingFrame>;

/// The stamp by which samples are ordered; for a stereo frame the left one.
Stamp stamp_of(const Sample& sample);

}  // namespace spartan
