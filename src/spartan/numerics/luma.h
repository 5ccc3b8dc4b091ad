// Conversion of colour to gray.
#pragma once

#include "spartan/core/image.h"

namespace spartan {

/// Luma of a colour (ITU-R BT.601: 0.299 R + 0.587 G + 0.114 B) in 16-bit fixed point, rounded.
template <class T>
T luma(const Rgb<T>& colour) {
  return static_cast<T>((19595U * colour.r + 38470U * colour.g + 7471U * colour.b + 32768U) >> 16U);
}

}  // namespace spartan
