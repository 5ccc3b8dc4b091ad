#include "program/image_memory.h"

#include <fmt/format.h>

#include "spartan/image_io/image_io.h"

namespace spartan::program {

Status check_images_fit(const std::vector<std::string>& files, std::int64_t bytes_of_pixel, std::int64_t most_bytes) {
  for (const std::string& file : files) {
    const auto size = read_image_size(file);
    const std::int64_t needed = size ? bytes_of_pixel * size->width * size->height : 0;
    if (needed <= most_bytes) continue;
    return failure(
        ErrorCode::resources,
        fmt::format("an image of {}x{} px needs {:.0f} MB of memory, more than the bound of {:.0f} MB", size->width,
                    size->height, 1e-6 * static_cast<double>(needed), 1e-6 * static_cast<double>(most_bytes)),
        file, "use smaller images, or raise --memory");
  }
  return {};
}

}  // namespace spartan::program
