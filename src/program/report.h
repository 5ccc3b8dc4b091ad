// The report page of a simulated drive: what was seen, where the rover went, how right it was.
#pragma once

#include <string>

#include "spartan/core/result.h"

namespace spartan::program {

/// One self-contained HTML page about a run of a recording with truth.
Result<std::string> make_report(const std::string& recording, const std::string& run, int threads);

}  // namespace spartan::program
