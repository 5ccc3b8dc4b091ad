// The images of the two eyes of a KITTI recording: files whose numbers say to which shot they belong.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spartan/core/image.h"

namespace spartan {

/// Image files of one shot; empty where an eye has none.
struct ImageFiles {
  std::string left, right;
};

struct NumberedImages {
  std::vector<ImageFiles> shots;     ///< one for each announced shot
  std::int64_t first_number = 0;     ///< file number of shots[0]
  std::vector<std::string> remarks;  ///< images that no shot claims; numbers that do not begin at 0
};

/// Puts the files of two folders (png, jpg, jpeg, pgm) to the shots. File numbers count from 0; where none of them lies
/// in [0, announced) from the lowest one; where names are no such numbers, the sorted names count.
/// `announced` none: as many shots as the numbers span, from the lowest one on.
NumberedImages number_images(const std::string& left_folder, const std::string& right_folder,
                             std::optional<std::size_t> announced);

/// The size that most of the left images have, from the headers of some files spread over the recording.
std::optional<ImageSize> common_image_size(const std::vector<ImageFiles>& shots);

}  // namespace spartan
