// Integrity check of image files before they are decoded.
#pragma once

#include <string>
#include <string_view>

namespace spartan::internal {

/// Parses the container structure of a PNG, JPEG, PGM or PPM file; returns a description of the first error, or an
/// empty string if the file is complete. Detects files that are empty, of another format, truncated, or have an
/// implausible size: decoders would silently fill missing pixels with gray, or allocate gigabytes for a damaged header.
/// Bytes after the end of the image are allowed.
/// Sources: PNG specification (ISO/IEC 15948) §5; JPEG (ITU-T T.81) annex B; netpbm's pgm(5), ppm(5).
std::string image_file_error(std::string_view content);

/// Larger images are rejected as damaged headers: sides in pixels, and the number of pixels.
constexpr std::size_t kMaxImageSide = 32768;
constexpr std::size_t kMaxImagePixels = std::size_t{1} << 27U;

}  // namespace spartan::internal
