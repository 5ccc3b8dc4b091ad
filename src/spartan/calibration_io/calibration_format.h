// The supported formats of calibration files, and their detection from names and content.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spartan/core/result.h"

namespace spartan {

enum class CalibrationFormat { rig_yaml, kitti, kitti_raw, euroc, kalibr, opencv, ros, mrcal, tsai, cahvor };

/// The name of a format: "rig.yaml", "kitti", "kitti-raw", "euroc", "kalibr", "opencv", "ros", "mrcal", "tsai",
/// "cahvor".
std::string_view name_of(CalibrationFormat format);
/// The format with that name, if there is one.
std::optional<CalibrationFormat> calibration_format_named(std::string_view name);
/// The names of all formats.
std::vector<std::string_view> calibration_format_names();

/// Whether the format stores each camera of a pair in a file of its own.
bool has_file_per_camera(CalibrationFormat format);
/// Whether the files contain the image size.
bool contains_image_size(CalibrationFormat format);

/// Detects the format of an existing file from its extension and its text; nullopt if it is unknown.
std::optional<CalibrationFormat> detect_calibration_format(const std::string& path, const std::string& text);
/// The format to write to a path, from its file name; code `usage` if the name does not determine it. A name without
/// extension is a folder of EuRoC's layout.
Result<CalibrationFormat> calibration_format_for_path(const std::string& path);

}  // namespace spartan
