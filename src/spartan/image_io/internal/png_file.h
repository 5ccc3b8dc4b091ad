// PNG files, by libpng.
#pragma once

#include <string>
#include <string_view>

#include "spartan/core/frame_image.h"
#include "spartan/core/result.h"

namespace spartan::internal {

enum class PngColour { as_stored, gray };

/// Decodes to gray or RGB with 8 bits, or 16 where the file has 16; palettes become RGB, 1, 2 and 4 bits become 8, and
/// an alpha channel is dropped. With `gray` the result is 8-bit gray: luma of Rec. 601, the upper 8 of 16 bits. Code
/// `input`: damaged. Throws std::bad_alloc if memory runs out.
Result<FrameImage> decode_png(std::string_view content, PngColour colour);

/// The layout of the pixels to encode.
struct PngPixels {
  const void* data = nullptr;  ///< of the first row; 16-bit samples in the byte order of the machine
  ImageSize size;              ///< px
  std::size_t row_bytes = 0;   ///< from one row to the next
  int bits = 8;                ///< of a sample: 8 or 16
  bool rgb = false;            ///< three samples a pixel instead of one
};
/// The bytes of a PNG file, with the filter, strategy and compression level that OpenCV chooses for speed. Throws
/// std::bad_alloc if memory runs out.
std::string encode_png(const PngPixels& pixels);

}  // namespace spartan::internal
