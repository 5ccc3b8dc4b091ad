// A rectified pair that owns its images: those of RectifiedPair are only valid until the next frame.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/imaging/imager.h"

namespace spartan::python {

struct RectifiedPairValue {
  Image<std::uint8_t> left, right, left_mask, right_mask;
  RectifiedPair pair;  ///< views of them
};

/// Copies the images.
RectifiedPairValue owned(const RectifiedPair& pair);

}  // namespace spartan::python
