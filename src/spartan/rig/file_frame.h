// Rigs from formats that place each camera in a frame which they do not explain. Internal to rig.
#pragma once

#include <functional>

#include "spartan/rig/calibration_writers.h"
#include "spartan/rig/rig.h"
#include "spartan/rig/rig_files.h"

namespace spartan::rig_detail {

/// A rig of two cameras whose `mount_from_camera` is the pose in the frame of their files. The body is
///  - that frame, where the left camera looks along it as REP-103 has it: its right axis mostly along −y, its down
///    axis mostly along −z;
///  - that frame turned by 180° about x, where it is forward-right-down: right mostly +y, down mostly +z;
///  - the left camera turned to x forward, y left, z up (rig_of_one_pair) in any other frame.
/// "Mostly" is the axis with the largest part. A note says which. The pair is named `stereo`.
ReadRig rig_in_frame_of_files(CalibrationFormat format, Camera left, Camera right);

/// Reads a file; the camera's `mount_from_camera` is its pose in the file's frame.
using EyeReader = std::function<Result<Camera>(const std::string& path, const std::string& name)>;
/// The cameras `left` and `right` of two such files, validated.
Result<ReadRig> read_two_files(CalibrationFormat format, const std::string& left_path, const std::string& right_path,
                               const EyeReader& read_eye);

/// The text of a camera's file.
using EyeWriter = std::function<Result<std::string>(const Camera& camera, const Pose& file_from_camera)>;
/// The two files of a rig that is one pair; `path` as in names_of_pair(). Their frame is the body, or the left camera
/// where the body is nothing else: so that reading them finds the same rig.
Result<CalibrationFiles> write_two_files(const Rig& rig, CalibrationFormat format, const std::string& path,
                                         const EyeWriter& text_of);

/// Whether the body is the camera turned to x forward, y left, z up, and the poses are those of the camera.
bool body_is_left_camera(const Rig& rig, const StereoPair& pair);

}  // namespace spartan::rig_detail
