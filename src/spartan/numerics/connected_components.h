// Connected components of a mask.
#pragma once

#include <cstdint>
#include <vector>

#include "spartan/core/image.h"

namespace spartan {

struct PixelIndex {
  int x = 0, y = 0;
  friend bool operator==(const PixelIndex&, const PixelIndex&) = default;
};

/// The 8-connected components of the pixels that are not 0, in raster order of their first pixel. The pixels of a
/// component are in the order of a depth-first flood fill from that pixel (the neighbours of a pixel are pushed in
/// raster order and visited last in, first out), so sums over them have reproducible rounding.
std::vector<std::vector<PixelIndex>> connected_components(ImageView<const std::uint8_t> mask);

}  // namespace spartan
