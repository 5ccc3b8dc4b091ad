// Detects images that are blurred in comparison to those before.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"

namespace spartan::internal {

/// Mean absolute difference of neighbouring pixels, gray levels times 256.
struct Sharpness {
  float along_x = 0, along_y = 0;
};

/// Of every fourth row.
Sharpness sharpness_of(ImageView<const std::uint16_t> smooth);

/// Whether an image has lost a large part of its differences in either direction since another one of the same camera,
/// as by motion blur. False where there is no other one.
bool is_blurred(const Sharpness& image, const Sharpness& before);

}  // namespace spartan::internal
