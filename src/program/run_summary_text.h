// The summary of a run for the terminal.
#pragma once

#include <string>

namespace spartan::program {

/// `summary_json`: content of summary.json; `folder`: of the run.
std::string run_summary_text(const std::string& summary_json, const std::string& folder);

}  // namespace spartan::program
