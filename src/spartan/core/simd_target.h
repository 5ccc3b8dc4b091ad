// Choosing the instruction set of a kernel by name, without any global state.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace spartan {

/// Position of the chosen target in a Highway dispatch table. "auto" takes the best that this processor has; a name
/// that it does not have takes the best one below it.
std::size_t simd_target_index(const std::string& name);

/// Names that can be told apart on this processor, best last: "sse4", "avx2", "avx3".
std::vector<std::string> available_simd_targets();

}  // namespace spartan
