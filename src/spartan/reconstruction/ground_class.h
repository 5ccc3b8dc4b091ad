// Classes of pixels and map cells relative to the ground surface.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"

namespace spartan {

/// Class of a pixel or a map cell. A map cell of class `ground` is free; a cavity is a negative obstacle. The values
/// are those of the band "class" of map files (docs/reference/files.md).
enum class GroundClass : std::uint8_t { unknown = 0, ground = 1, obstacle = 2, cavity = 3 };

/// The band "class" of a map file.
Image<float> class_band(ImageView<const GroundClass> classes);

}  // namespace spartan
