// Image size from the header of an image file, without decoding it.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "spartan/core/image.h"

namespace spartan::internal {

/// Size from the header of a PNG, JPEG or PGM/PPM file; nothing where the header is of none of these.
std::optional<ImageSize> read_image_size(const std::string& path);
/// The same from the first bytes of a file.
std::optional<ImageSize> parse_image_size(std::string_view head);

}  // namespace spartan::internal
