// What a matcher finds, before any check except the one against the image border.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"

namespace spartan::internal::matching {

/// Where a matcher writes its result; both images have the size of the pair.
struct Matches {
  ImageView<float> disparity;  ///< px; NaN where x − d lies outside of the right image.
  ImageView<std::uint8_t>
      right_distance;  ///< px, 0 … 16: from x to the left pixel that the matched right pixel prefers.
};

}  // namespace spartan::internal::matching
