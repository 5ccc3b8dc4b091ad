// Selection of the SIMD instruction set of a kernel by name, without global state.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace spartan {

/// Index of a target in a Highway dispatch table. `name` is "sse4", "avx2" or "avx3"; "auto" selects the best target of
/// this processor. A target that the processor does not support falls back to the best supported one below it.
std::size_t simd_target_index(const std::string& name);

/// The targets that this processor supports, best last: "sse4", "avx2", "avx3".
std::vector<std::string> available_simd_targets();

}  // namespace spartan
