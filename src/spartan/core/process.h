// What this process has used, for reports only.
#pragma once

#include <cstdint>

namespace spartan {

/// CPU time of all threads since the process began.
double cpu_seconds();
/// The most memory that was resident at a time.
std::int64_t peak_memory_bytes();

}  // namespace spartan
