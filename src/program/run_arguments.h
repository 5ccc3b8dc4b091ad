// Options of a run from the command line: defaults, then a file, then single assignments.
#pragma once

#include <string>
#include <vector>

#include "program/context.h"
#include "program/progress.h"
#include "spartan/core/result.h"
#include "spartan/system/run.h"
#include "spartan/system/run_options.h"

namespace spartan::program {

struct ChosenOptions {
  RunOptions options;
  GivenKeys given;  ///< keys that the file or an assignment names
};

/// `file` may be empty. Warns of former names of options. Codes: `configuration` (the file, or values that contradict
/// each other), `usage` (an assignment).
Result<ChosenOptions> choose_options(const Context& context, const std::string& file,
                                     const std::vector<std::string>& assignments);

/// The same without the keys.
Result<RunOptions> run_options(const Context& context, const std::string& file,
                               const std::vector<std::string>& assignments);

/// Log, progress and interrupt of a run. Borrows `progress`.
RunHooks run_hooks(const Context& context, Progress& progress);

}  // namespace spartan::program
