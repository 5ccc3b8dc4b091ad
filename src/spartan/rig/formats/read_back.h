// What files will say once they are written. Nothing is written where they shall be.
#pragma once

#include "spartan/rig/formats/rig_files.h"
#include "spartan/rig/formats/rig_writing.h"

namespace spartan {

/// Reads the files of to_calibration_files() as that format, in a temporary folder, together with what lies at their
/// place already and would be read with them: further cameras of EuRoC, the IMU of KITTI raw, OpenCV's other file.
/// Errors name the files by their own places; code `output` where there is no temporary folder.
Result<ReadRig> read_back(const CalibrationFiles& files, CalibrationFormat format, ImageSize size);

}  // namespace spartan
