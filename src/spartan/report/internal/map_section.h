// The report's section on maps: local maps of stops and keyframes, coverage of the global map.
#pragma once

#include <optional>
#include <string>

#include "spartan/core/result.h"
#include "spartan/figures/plot.h"

namespace spartan::internal {

/// The global map of a run; none if it is empty or too large for one image (GlobalMap::kMostCells). Codes: those of
/// SavedMap::open() and GlobalMap::view().
Result<std::optional<Plot>> global_map_plot(const std::string& run);

/// At most six local maps over the drive, and how often each cell of the global map was observed; empty without maps.
/// `heading_east`: whether x of the world is east, by a compass.
Result<std::string> map_section(const std::string& run, bool heading_east);

}  // namespace spartan::internal
