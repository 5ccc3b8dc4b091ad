// The size of a picture file without decoding it.
#pragma once

#include <optional>
#include <string>

#include "spartan/core/image.h"

namespace spartan {

/// From the header of a PNG, JPEG or PGM/PPM file; nothing where there is no such header.
std::optional<ImageSize> read_image_size(const std::string& path);

}  // namespace spartan
