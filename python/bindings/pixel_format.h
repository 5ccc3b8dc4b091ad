// Pixel formats by the names that Python uses.
#pragma once

#include <string>

#include "spartan/core/frame_image.h"

namespace spartan::python {

/// `layout`: "gray", "rgb", "bayer_rggb" …; `bits`: significant bits of a sample, 8 to 16; `alignment`: "low" or
/// "high", where they are in a sample of 16 bits. Raises ValueError for others.
PixelFormat pixel_format(const std::string& layout, int bits, const std::string& alignment);
/// The name of the alignment.
std::string alignment_name(const PixelFormat& format);
inline constexpr const char* kAlignmentMeaning =
    "`low` or `high`: which bits of a sample of 16 bits are the significant ones.";

}  // namespace spartan::python
