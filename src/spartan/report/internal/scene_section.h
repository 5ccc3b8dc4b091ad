// The report's section that shows terrain and trajectories in 3D.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {

/// HTML with the scripts of scene_files() and their data; empty without a map and where the program was
/// built without three.js. Codes: those of SavedMap::open().
Result<std::string> scene_section(const std::string& run, RunStore& store, const std::vector<FrameRecord>& frames);

}  // namespace spartan::internal
