#include "spartan/core/frame_image.h"

namespace spartan {

std::string_view name_of(PixelLayout layout) {
  switch (layout) {
    case PixelLayout::gray:
      return "gray";
    case PixelLayout::rgb:
      return "rgb";
    case PixelLayout::bayer_rggb:
      return "bayer_rggb";
    case PixelLayout::bayer_grbg:
      return "bayer_grbg";
    case PixelLayout::bayer_gbrg:
      return "bayer_gbrg";
    case PixelLayout::bayer_bggr:
      return "bayer_bggr";
  }
  return "unknown";
}

}  // namespace spartan
