// A run's results in the formats of other tools.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/system/run_trajectory.h"

namespace spartan {

enum class ExportFormat { tum, kitti, euroc, csv, geotiff, ply };

/// Code `usage` for an unknown name.
Result<ExportFormat> parse_export_format(std::string_view name);

/// tum, euroc: world_from_body of every measured pose. kitti: first left optical frame from left optical frame, one
/// line for every announced shot; a shot without a pose has the predicted one. csv: every shot with status, pose and
/// standard deviations (empty where it has none). geotiff: the global map. ply: the terrain's point clouds, all in one.
/// `kind` chooses among trajectories; none: the best that the run has. Codes: `input` (no run there, or without what is
/// asked for), `output`.
Status export_run(const std::string& run_folder, ExportFormat format, std::optional<TrajectoryKind> kind,
                  const ThreadPool& workers, const std::string& path);

}  // namespace spartan
