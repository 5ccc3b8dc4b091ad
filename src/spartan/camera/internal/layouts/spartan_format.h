// File headers and recording.yaml of Spartan recordings, shared by writer and reader (docs/reference/recording.md).
#pragma once

#include <string>

#include "spartan/camera/recording_writer.h"
#include "spartan/core/options.h"

namespace spartan::internal {

inline constexpr const char* kFinishedFile = "recording.yaml";
/// The properties of a recording of a stream until it is finished, which recording.yaml replaces.
inline constexpr const char* kUnfinishedFile = "unfinished_recording.yaml";
inline constexpr const char* kFramesHeader =
    "frame_id,position_id,pair,left_stamp_ns,right_stamp_ns,left,right,pan_deg,tilt_deg,exposure_us,gain,bits";
inline constexpr const char* kLeastFramesHeader = "left_stamp_ns,left,right";  ///< of a list that is written by hand
inline constexpr const char* kImuHeader =
    "stamp_ns,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2";
inline constexpr const char* kWheelsHeader = "stamp_ns,left_m,right_m";
inline constexpr const char* kCompassHeader = "stamp_ns,heading_rad,sigma_rad";
inline constexpr const char* kInclinometerHeader = "stamp_ns,roll_rad,pitch_rad,sigma_rad";

/// The contents of recording.yaml.
struct RecordingFile {
  int schema = 1;  ///< version of the format
  RecordingOptions about;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("schema", schema, "Version of this file format.", between(1, 1));
    v.field("name", about.name, "Name of the recording, shown in reports.");
    v.field("description", about.description, "Description of the recording, e.g. where and how it was made.");
    v.field("gravity_m_s2", about.gravity_m_s2,
            "Gravitational acceleration at the recording site in m/s²: 9.81 on Earth, 3.71 on Mars.", between(0.1, 30));
    v.group("imu_noise", about.noise.imu);
    v.group("compass_noise", about.noise.compass);
    v.group("inclinometer_noise", about.noise.inclinometer);
  }
};

}  // namespace spartan::internal
