// The report's part on where the rover went: every trajectory beside the truth, its error with its 3σ.
#pragma once

#include <string>
#include <vector>

#include "program/compared_trajectories.h"
#include "spartan/core/result.h"
#include "spartan/eval/trajectory_metrics.h"
#include "spartan/system/run_store.h"

namespace spartan::program {

/// A trajectory's errors as the whole page has them: with the first poses aligned or, where the truth knows no
/// rotation, after the best fit. Codes: compare_trajectories'.
Result<TrajectoryMetrics> errors_of(const ComparedTrajectories& compared);
std::string in_words(Alignment alignment);

/// Plots of each trajectory of the run; where the truth is known (not empty) beside it, aligned as in errors_of().
Result<std::string> trajectory_plots(const std::string& run, const std::vector<FrameRecord>& frames,
                                     const std::string& truth);

}  // namespace spartan::program
