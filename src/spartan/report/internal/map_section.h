// The report's part on the maps of a run.
#pragma once

#include <string>

#include "spartan/core/result.h"

namespace spartan::internal {

/// Images of the local maps, spread over the drive, and of the global map; empty if there are none.
Result<std::string> map_images(const std::string& run);

}  // namespace spartan::internal
