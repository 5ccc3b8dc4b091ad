// Rigs from formats that give camera poses in an undocumented frame. Internal to calibration_io.
#pragma once

#include <functional>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/calibration_io/internal/calibration_writers.h"
#include "spartan/rig/rig.h"

namespace spartan::internal {

/// A rig of two cameras whose `mount_from_camera` is the pose in the frame of their files. The body frame is
///  - the frame of the files, if it is plausible as a body frame with x forward, y left, z up (REP-103): the image x
///  axis
///    of the left camera mainly along −y (it looks forward) or +y (it looks backward), the image y axis downwards (−z),
///    both cameras within 100 m of the origin;
///  - the frame of the files rotated by 180° about x, if it is forward-right-down: as above with downwards along +z;
///  - otherwise the left camera, turned to x forward, y left, z up (rig_of_one_pair); `ignored` reports the lost pose.
/// "Mainly" refers to the largest component, so any tilt works except within one degree of vertical. `body` describes
/// the chosen frame. The pair is named `stereo`.
LoadedRig rig_in_frame_of_files(CalibrationFormat format, Camera left, Camera right);

/// A camera whose `mount_from_camera` is its pose in the frame of the file, and the ignored content of the file.
struct CameraOfFile {
  Camera camera;
  std::vector<RigDifference> ignored = {};
};
using CameraReader = std::function<Result<CameraOfFile>(const std::string& path, const std::string& name)>;
/// Reads the cameras `left` and `right` from two such files into a validated rig.
Result<LoadedRig> read_two_files(CalibrationFormat format, const std::string& left_path, const std::string& right_path,
                                 const CameraReader& read_camera);

/// Formats the file of one camera.
using CameraWriter = std::function<Result<std::string>(const Camera& camera, const Pose& file_from_camera)>;
/// The two files of a rig that is one pair; `path` as in names_of_pair(). Poses are given in the body frame, or in the
/// left optical frame if the body is that camera, so that reading the files gives the same rig.
Result<CalibrationFiles> write_two_files(const Rig& rig, CalibrationFormat format, const std::string& path,
                                         const CameraWriter& text_of);

/// Whether the body frame is the left camera turned to x forward, y left, z up, and poses follow `left_optical`.
bool body_is_left_camera(const Rig& rig, const StereoPair& pair);

}  // namespace spartan::internal
