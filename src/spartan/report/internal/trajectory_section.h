// The report's section on trajectories: on the global map, with the truth; errors beside their 3σ.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/figures/plot.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {

struct TrajectorySectionInput {
  std::string run;    ///< folder
  std::string truth;  ///< for find_trajectories(); empty: none
  const std::vector<FrameRecord>& frames;
  std::optional<Plot> map;    ///< of the global map, to draw the trajectories on
  bool heading_east = false;  ///< x of the world is east
};

/// Plots of the trajectories of the run, with the truth if there is one. The first poses are aligned, because the
/// covariances are relative to the start; if the truth has no rotation, SE3. The truth is cut to the time of the
/// trajectory. Says where an error leaves its 3σ.
Result<std::string> trajectory_section(TrajectorySectionInput input);

}  // namespace spartan::internal
