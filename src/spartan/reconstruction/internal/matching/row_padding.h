// Kernels work on whole vectors: rows must be readable and writable behind their last pixel.
#pragma once

namespace spartan::internal::matching {

inline constexpr int kRowPadding = 64;  ///< Bytes of the widest vector.

}  // namespace spartan::internal::matching
