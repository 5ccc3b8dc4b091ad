// The report's section on maps: the global map, how often its cells were observed, local maps of stops and keyframes.
#pragma once

#include <optional>
#include <string>

#include "spartan/core/result.h"
#include "spartan/figures/plot.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {

/// The global map of a run.
struct GlobalMapFigures {
  std::optional<Plot> map;  ///< none where it is empty
  std::string coverage;     ///< HTML: the number of points in each cell; empty without a map
};
/// `heading_east`: whether x of the world is east, by a compass. Codes: those of SavedMap::open() and
/// GlobalMap::view().
Result<GlobalMapFigures> global_map_figures(const std::string& run, RunStore& store, bool heading_east);

/// At most six local maps over the drive; empty without maps.
Result<std::string> local_map_figures(const std::string& run, RunStore& store, bool heading_east);

}  // namespace spartan::internal
