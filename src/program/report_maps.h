// The report's part on the maps of a run.
#pragma once

#include <string>

#include "spartan/core/result.h"

namespace spartan::program {

/// Pictures of the local maps, spread over the drive, and of the global one; empty where there are none.
Result<std::string> map_pictures(const std::string& run);

}  // namespace spartan::program
