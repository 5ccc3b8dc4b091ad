// Rigs from formats that place each camera in a frame which they do not explain. Internal to rig.
#pragma once

#include <functional>

#include "spartan/rig/formats/calibration_writers.h"
#include "spartan/rig/formats/rig_files.h"
#include "spartan/rig/rig.h"

namespace spartan::rig_detail {

/// A rig of two cameras whose `mount_from_camera` is the pose in the frame of their files. The body is
///  - that frame, where the left camera stands in it as on a rover with x forward, y left, z up (REP-103): its right
///  axis
///    mostly along −y (it looks ahead) or +y (it looks back), its down axis with −z, both eyes within 100 m;
///  - that frame turned by 180° about x, where it is forward-right-down: the same with down along +z;
///  - the left camera turned to x forward, y left, z up (rig_of_one_pair) in any other frame, with `left_out` saying
///  so.
/// "Mostly" is the axis with the largest part: any tilt but within a degree of straight up or down will do. `body` says
/// which. The pair is named `stereo`.
ReadRig rig_in_frame_of_files(CalibrationFormat format, Camera left, Camera right);

/// A camera whose `mount_from_camera` is its pose in the file's frame, and what the file holds besides.
struct EyeOfFile {
  Camera camera;
  std::vector<RigDifference> left_out = {};
};
using EyeReader = std::function<Result<EyeOfFile>(const std::string& path, const std::string& name)>;
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
