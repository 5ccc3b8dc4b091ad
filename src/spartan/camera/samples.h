// What the sensors of a rover deliver: plain values with a time stamp.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <variant>

#include "spartan/core/frame_image.h"
#include "spartan/core/time.h"

namespace spartan {

/// One shot of one stereo pair. The images may borrow memory that the caller keeps (see FrameImage).
struct StereoFrame {
  std::int64_t frame_id = 0;
  std::int64_t position_id = -1;  ///< shots of one stop share it; −1: not stated
  std::string pair;               ///< name in the rig
  Stamp left_stamp, right_stamp;  ///< mid-exposure
  FrameImage left, right;
  double pan_rad = 0, tilt_rad = 0;
  double exposure_us = 0, gain = 0;  ///< 0: not stated
};

struct ImuSample {
  Stamp stamp;
  Eigen::Vector3d gyro_rad_s = Eigen::Vector3d::Zero();  ///< body frame
  Eigen::Vector3d accel_m_s2 = Eigen::Vector3d::Zero();  ///< specific force, body frame: at rest it points up
};

/// Rolled distance of the wheels of each side since the start.
struct WheelSample {
  Stamp stamp;
  double left_m = 0, right_m = 0;
};

/// Heading of body x, counter-clockwise from east.
struct CompassSample {
  Stamp stamp;
  double heading_rad = 0, sigma_rad = 0;
};

struct InclinometerSample {
  Stamp stamp;
  double roll_rad = 0, pitch_rad = 0, sigma_rad = 0;
};

/// Why a shot that the recording announces is not there.
enum class FrameFault { left_missing, right_missing, unreadable, wrong_size, stamp_reversed, stamps_apart };

/// "left_missing" …: the keys under `skipped` in summary.json.
std::string_view name_of(FrameFault fault);

/// Stands in the stream where a shot should be: said, counted, skipped.
struct MissingFrame {
  std::int64_t frame_id = 0;
  std::string pair;
  Stamp stamp;
  FrameFault fault = FrameFault::unreadable;
  std::string message;  ///< names the file and what is wrong with it
};

using Sample = std::variant<StereoFrame, ImuSample, WheelSample, CompassSample, InclinometerSample, MissingFrame>;

/// The stamp that orders samples (a stereo frame's left one).
Stamp stamp_of(const Sample& sample);

}  // namespace spartan
