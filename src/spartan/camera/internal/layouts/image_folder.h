// Folders of images of the left and the right camera.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/result.h"

namespace spartan::internal {

/// Image files (png, jpg, jpeg, pgm, ppm) of a folder whose names match a pattern of fnmatch(3): stem → path. Of files
/// with the same stem, the first extension in that order counts. A folder that does not exist has none. Codes:
/// `read_error`, `resources`.
Result<std::map<std::string, std::string>> list_images(const std::string& folder, const std::string& pattern = "*");

/// Image files of one frame; an empty path where the image is missing.
struct ImageFiles {
  std::string left, right;
};

struct NumberedImages {
  std::vector<ImageFiles> frames;    ///< one entry for each listed frame
  std::int64_t first_number = 0;     ///< file number of frames[0]
  std::vector<std::string> remarks;  ///< images that belong to no frame; numbers that do not start at 0
};

/// Assigns the files of two folders (png, jpg, jpeg, pgm) to frames. The file number is the frame index; where no
/// number lies in [0, announced), indices are relative to the lowest number. Where names are not such numbers, the rank
/// among the sorted names is the index. Without `announced` there are as many frames as the range of the numbers holds.
/// Codes: `read_error`, `resources`; a folder that does not exist has no images.
Result<NumberedImages> number_images(const std::string& left_folder, const std::string& right_folder,
                                     std::optional<std::size_t> announced);

/// The most frequent size of images, from the headers of up to 16 files spread over the list.
std::optional<ImageSize> common_image_size(const std::map<std::string, std::string>& images);

}  // namespace spartan::internal
