// Which trajectory of a run is exported.
#pragma once

#include <optional>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/system/run_folder.h"

namespace spartan::internal {

/// `wanted`, or the best that the run has. Code `input`: there are no frames, or not this trajectory.
Result<TrajectoryKind> exported_trajectory(const RunFolder& folder, const std::vector<FrameRecord>& frames,
                                           std::optional<TrajectoryKind> wanted);

}  // namespace spartan::internal
