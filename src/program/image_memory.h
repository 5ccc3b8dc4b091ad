// Whether images fit into memory.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "spartan/core/result.h"

namespace spartan::program {

/// Before anything is decoded: a small file may hold a huge image. Code `resources` where an image, at that many bytes
/// a pixel, needs more than `most_bytes`.
Status check_images_fit(const std::vector<std::string>& files, std::int64_t bytes_of_pixel, std::int64_t most_bytes);

}  // namespace spartan::program
