// Pixel formats by the names that Python uses.
#pragma once

#include <string>

#include "spartan/core/frame_image.h"

namespace spartan::python {

/// `layout`: "gray", "rgb", "bayer_rggb" …; `bits`: significant bits of a sample, 8 to 16. Raises ValueError for
/// others.
PixelFormat pixel_format(const std::string& layout, int bits);

}  // namespace spartan::python
