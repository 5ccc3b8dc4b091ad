// What the bytes of a picture file promise, before a decoder is let loose on them.
#pragma once

#include <string>
#include <string_view>

namespace spartan {

/// Walks the container of a PNG, JPEG, PGM or PPM file and says what is wrong with it; empty where it is whole.
/// Decoders fill missing pixels with gray and stay silent, or trust a header of noise and ask for gigabytes:
/// found here are files that are empty, of another kind, end early, or have a senseless size.
/// Bytes behind the end of the picture are allowed.
/// Sources: PNG specification (ISO/IEC 15948) §5; JPEG (ITU-T T.81) annex B; netpbm's pgm(5), ppm(5).
std::string picture_file_fault(std::string_view content);

/// Headers beyond these are taken for noise.
constexpr std::size_t kLargestImageSide = 32768;
constexpr std::size_t kMostImagePixels = std::size_t{1} << 27U;

}  // namespace spartan
