// Resource usage of this process, for reports only.
#pragma once

#include <cstdint>

namespace spartan {

/// CPU time of all threads since the start of the process, s.
double cpu_seconds();
/// The peak resident memory of the process, bytes.
std::int64_t peak_memory_bytes();

}  // namespace spartan
