// A run's results in the formats of other tools.
#pragma once

#include <string>
#include <string_view>

#include "spartan/core/result.h"

namespace spartan {

enum class ExportFormat { tum, kitti, euroc, csv, ply };

/// Code `usage` for an unknown name.
Result<ExportFormat> parse_export_format(std::string_view name);

/// tum, euroc: world_from_body of every measured pose. kitti: first left optical frame from left optical frame, one
/// line for every announced shot; a shot without a pose has the predicted one. csv: every shot with status, pose and
/// standard deviations. ply: the terrain's point clouds, all in one. Codes: `input` (no run there), `output`.
Status export_run(const std::string& run_folder, ExportFormat format, const std::string& path);

}  // namespace spartan
