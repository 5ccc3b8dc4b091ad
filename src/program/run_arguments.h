// Options of a run from the command line: defaults, then a file, then single assignments.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/system/run_options.h"

namespace spartan::program {

/// `file` may be empty. Codes: `configuration` (the file), `usage` (an assignment).
Result<RunOptions> run_options(const std::string& file, const std::vector<std::string>& assignments);

}  // namespace spartan::program
