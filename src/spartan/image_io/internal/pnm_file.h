// PGM and PPM files (netpbm's pgm(5), ppm(5)): P2, P3 (text), P5, P6 (binary).
#pragma once

#include <optional>
#include <string_view>

#include "spartan/core/frame_image.h"
#include "spartan/core/result.h"

namespace spartan::internal {

struct PnmHeader {
  bool binary = false, colour = false;
  std::size_t width = 0, height = 0;  ///< px; as stated, also 0 or beyond any limit
  std::size_t largest = 0;            ///< the largest value of a sample, as stated
  std::string_view samples;           ///< what follows the header
};

/// Nothing where the content does not begin as one of these files. A number that is missing is 0.
std::optional<PnmHeader> parse_pnm_header(std::string_view content);

/// Decodes to gray or RGB with the values of the file: 8 bits up to a largest value of 255, else 16. Code `input`: a
/// sample is missing, or does not fit into 8 or 16 bits. The header must be plausible (image_file_error()).
Result<FrameImage> decode_pnm(std::string_view content);

}  // namespace spartan::internal
