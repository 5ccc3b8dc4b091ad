// What of a run folder must be the same, whatever happened on the way (docs/reference/files.md).
#pragma once

#include <map>
#include <string>

namespace spartan::testing {

/// Name → content of every byte-stable file; run.sqlite as the text of its tables without the time columns.
std::map<std::string, std::string> byte_stable_content(const std::string& run_folder);

}  // namespace spartan::testing
