// Camera images between numpy and FrameImage, without copies.
#pragma once

#include <nanobind/nanobind.h>

#include <optional>
#include <string>

#include "bindings/arrays.h"
#include "spartan/core/frame_image.h"

namespace spartan::python {

/// An image that keeps the array alive. Shape (height, width) for `gray` and Bayer patterns, (height, width, 3) for
/// `rgb`; uint8 for 8 bits, uint16 for more. `bits`: of a sample; none: 8 or 16 by the type. `alignment`: see
/// pixel_format(). Raises TypeError or ValueError for other arrays. The array must not be changed while the image is in
/// use.
FrameImage image_of_array(const AnyArray& array, const std::string& layout, std::optional<int> bits,
                          const std::string& alignment, const char* name);

/// A read-only array that keeps the pixels alive; None for an empty image.
nb::object array_of_image(const FrameImage& image);

}  // namespace spartan::python
