// The SIMD instruction set that kernels use.
#pragma once

#include <array>

#include "spartan/core/options.h"

namespace spartan {

/// SIMD instruction set of a kernel; it affects the speed only, results are the same bit for bit. One that the
/// processor does not support falls back to the best supported one below it.
enum class SimdTarget {
  automatic,  ///< the best one that the processor supports ("auto" in files)
  sse4,
  avx2,
  avx3,  ///< AVX-512
};
constexpr auto enum_names(SimdTarget) {
  return std::array{EnumName<SimdTarget>{SimdTarget::automatic, "auto"}, EnumName<SimdTarget>{SimdTarget::sse4, "sse4"},
                    EnumName<SimdTarget>{SimdTarget::avx2, "avx2"}, EnumName<SimdTarget>{SimdTarget::avx3, "avx3"}};
}

}  // namespace spartan
