// Selection of the SIMD instruction set of a kernel, without global state.
#pragma once

#include <cstddef>
#include <vector>

#include "spartan/core/simd.h"

namespace spartan {

/// Index of a target in a Highway dispatch table.
std::size_t simd_target_index(SimdTarget target);

/// The targets that this processor supports, best last; without `automatic`.
std::vector<SimdTarget> available_simd_targets();

}  // namespace spartan
