// Bytes of the buffers of the matchers.
#pragma once

#include <cstddef>

#include "spartan/core/image.h"

namespace spartan::internal::matching {

/// Bytes that an image holds, the padding of its rows included.
template <class T>
std::size_t bytes_of(const Image<T>& image) {
  return static_cast<std::size_t>(image.stride()) * static_cast<std::size_t>(image.height()) * sizeof(T);
}

}  // namespace spartan::internal::matching
