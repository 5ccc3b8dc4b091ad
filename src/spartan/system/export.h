// Exports the results of a run in the formats of other tools.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/system/run_folder.h"

namespace spartan {

enum class ExportFormat { tum, kitti, euroc, csv, geotiff, ply };

/// Code `usage` for an unknown name.
Result<ExportFormat> parse_export_format(std::string_view name);

/// tum, euroc: world_from_body of every measured pose. kitti: first left optical frame from left optical frame, one
/// line for every listed frame; a frame without a pose has the predicted one. csv: every frame with status, pose and
/// standard deviations (empty without a pose). geotiff: the global map. ply: all terrain point clouds in one file.
/// `kind` selects the trajectory; none: the best that the run has. Codes: `input` (no run, or a run without the
/// requested result), `output`.
Status export_run(const std::string& run_folder, ExportFormat format, std::optional<TrajectoryKind> kind,
                  const ThreadPool& workers, const std::string& path);

}  // namespace spartan
