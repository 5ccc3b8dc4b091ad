// The report's section on trajectories: each with the truth, its error and its 3σ bound.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/eval/trajectory_metrics.h"
#include "spartan/report/report.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {

/// Errors of a trajectory with the first poses aligned, or, if the truth has no rotation, after an SE3 fit. Codes as
/// compare_trajectories().
Result<TrajectoryMetrics> errors_of(const ComparedTrajectories& compared);
std::string alignment_text(Alignment alignment);

/// Plots of each trajectory of the run, with the truth if not empty, aligned as in errors_of().
Result<std::string> trajectory_plots(const std::string& run, const std::vector<FrameRecord>& frames,
                                     const std::string& truth);

}  // namespace spartan::internal
