// The formats of calibration files, and which of them a name means.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spartan/core/result.h"

namespace spartan {

enum class CalibrationFormat { rig_yaml, kitti, kitti_raw, euroc, kalibr, opencv, ros, mrcal, tsai, cahvor };

/// "rig.yaml", "kitti", "kitti-raw", "euroc", "kalibr", "opencv", "ros", "mrcal", "tsai", "cahvor".
std::string_view name_of(CalibrationFormat format);
std::optional<CalibrationFormat> calibration_format_named(std::string_view name);
std::vector<std::string_view> calibration_format_names();

/// Two files make a pair, one for each eye.
bool has_a_file_per_eye(CalibrationFormat format);
/// Whether the files say how large the pictures are.
bool holds_image_size(CalibrationFormat format);

/// The format that a name stands for by its ending, or that its text begins like; none where nothing is known by it.
std::optional<CalibrationFormat> guess_format(const std::string& path, const std::string& text);
/// The format to write under a name; code `usage` where the name does not tell. A name without an ending is EuRoC's
/// folder.
Result<CalibrationFormat> format_for_name(const std::string& path);

}  // namespace spartan
