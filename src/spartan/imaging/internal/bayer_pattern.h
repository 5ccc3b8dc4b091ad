// Position of the colours in a Bayer mosaic.
#pragma once

#include <stdexcept>

#include "spartan/core/frame_image.h"

namespace spartan::internal {

/// Column and row of red in the top-left 2×2 block. Blue is diagonal to it, green at the other two.
struct BayerPhase {
  int x, y;

  bool is_green(int column, int row) const { return ((column + x + row + y) & 1) != 0; }
  bool is_red_row(int row) const { return ((row + y) & 1) == 0; }
};

/// Throws where `layout` is not a Bayer pattern.
inline BayerPhase bayer_phase(PixelLayout layout) {
  switch (layout) {
    case PixelLayout::bayer_rggb:
      return {0, 0};
    case PixelLayout::bayer_grbg:
      return {1, 0};
    case PixelLayout::bayer_gbrg:
      return {0, 1};
    case PixelLayout::bayer_bggr:
      return {1, 1};
    case PixelLayout::gray:
    case PixelLayout::rgb:
      break;
  }
  throw std::invalid_argument("debayer: the layout is not a Bayer pattern");
}

}  // namespace spartan::internal
