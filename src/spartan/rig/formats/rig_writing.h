// Writing calibrations: the texts of files, and what they lost.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/rig/formats/calibration_format.h"
#include "spartan/rig/rig.h"

namespace spartan {

struct CalibrationFile {
  std::string path, content;
};
using CalibrationFiles = std::vector<CalibrationFile>;

/// The files that hold the rig in a format; nothing is written. `path` is the file, of EuRoC the folder, of formats
/// with a file for each eye "LEFT,RIGHT" or one name that becomes two. Code `configuration`, naming camera and
/// reason, where the format cannot say how the cameras see or has no place for all of them. Lesser things (names, pixel
/// formats, masks, a mast that turns, a skew below 0.01 px across the picture) are dropped: rig_differences.h tells.
Result<CalibrationFiles> to_calibration_files(const Rig& rig, CalibrationFormat format, const std::string& path);

/// The rig with nothing but this pair.
Rig rig_of_pair(const Rig& rig, const StereoPair& pair);

}  // namespace spartan
