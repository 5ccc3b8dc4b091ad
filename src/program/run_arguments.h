// Options of a run from the command line: defaults, then a file, then single assignments.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/system/run_options.h"

namespace spartan::program {

/// `file` may be empty. The keys that file and assignments name are added to `given`. Codes: `configuration` (the file,
/// or options that do not fit each other), `usage` (an assignment).
Result<RunOptions> run_options(const std::string& file, const std::vector<std::string>& assignments,
                               GivenKeys* given = nullptr);

}  // namespace spartan::program
