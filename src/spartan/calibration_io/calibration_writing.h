// Writing calibrations in any supported format.
#pragma once

#include <string>
#include <vector>

#include "spartan/calibration_io/calibration_format.h"
#include "spartan/core/result.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// The path and content of a file.
struct CalibrationFile {
  std::string path, content;
};
using CalibrationFiles = std::vector<CalibrationFile>;

/// The files that represent the rig in a format; nothing is written to disk. `path` is the file, for EuRoC the folder,
/// for formats with one file per camera "LEFT,RIGHT" or one path from which two are derived. Code `configuration`,
/// naming camera and reason, if the format cannot represent a camera model or all cameras. Other information (names,
/// pixel formats, masks, pan-tilt units, a skew below 0.01 px across the image) is dropped; see rig_differences.h.
Result<CalibrationFiles> to_calibration_files(const Rig& rig, CalibrationFormat format, const std::string& path);

/// The rig reduced to one pair, its cameras and their mounts.
Rig rig_of_pair(const Rig& rig, const StereoPair& pair);

}  // namespace spartan
