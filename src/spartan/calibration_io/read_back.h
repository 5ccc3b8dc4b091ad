// Reading calibration files as they will be after writing, without writing them to their destination.
#pragma once

#include "spartan/calibration_io/calibration_reading.h"
#include "spartan/calibration_io/calibration_writing.h"

namespace spartan {

/// Writes the files of to_calibration_files() to a temporary folder and reads them in that format, together with
/// existing files at their destination that would be read with them: further cameras of EuRoC, the IMU of KITTI raw,
/// OpenCV's other file. Errors name the files by their destination; code `output` if no temporary folder can be
/// created.
Result<LoadedRig> read_back(const CalibrationFiles& files, CalibrationFormat format, ImageSize size);

}  // namespace spartan
