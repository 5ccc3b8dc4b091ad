// Image files: reads PNG, JPEG, PGM/PPM and PFM; writes PNG, PGM/PPM and PFM.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "spartan/core/frame_image.h"
#include "spartan/core/result.h"

namespace spartan {

/// Decodes an image file into gray or RGB with 8 or 16 bits (`format.bits` is 8 or 16; FrameImage::with_format() sets
/// a smaller number of significant bits or a Bayer phase). Code `input`, with the path and the reason, if the file is
/// missing, empty, truncated (PNG without its end chunk, JPEG without its end marker), damaged as far as the decoder
/// detects it, or of another format.
Result<FrameImage> read_image(const std::string& path);

/// The same from memory; `name` is used in error messages.
Result<FrameImage> decode_image(const std::string& content, const std::string& name);

/// Size from the header of a PNG, JPEG or PGM/PPM file; nothing where the header is of none of these.
std::optional<ImageSize> read_image_size(const std::string& path);
/// The same from the first bytes of a file.
std::optional<ImageSize> parse_image_size(std::string_view head);

/// Decodes an image file into 8-bit gray: colour is converted to luma (Rec. 601), 16 bits are reduced to 8.
Result<Image<std::uint8_t>> read_gray8(const std::string& path);

/// 8- or 16-bit gray or RGB PNG, written atomically; code `output`.
Status write_png(const std::string& path, ImageView<const std::uint8_t> image);
Status write_png(const std::string& path, ImageView<const std::uint16_t> image);
Status write_png(const std::string& path, ImageView<const Rgb8> image);
// Doxygen takes the two RGB overloads for one.
/// @cond
Status write_png(const std::string& path, ImageView<const Rgb16> image);
/// @endcond

/// Encodes an image as PNG in memory.
Result<std::string> encode_png(ImageView<const std::uint8_t> image);
Result<std::string> encode_png(ImageView<const Rgb8> image);

/// The same of a camera's image, by its samples: significant bits and Bayer pattern are not stored.
std::string to_png(const FrameImage& image);
/// A binary PGM or PPM file of a camera's image (P5, P6; big-endian where a sample has 16 bits of storage): larger than
/// a PNG, and encoded at the speed of copying.
std::string to_pnm(const FrameImage& image);

/// Encodes a gray image as JPEG in memory, with a quality from 1 to 100. Code `internal` if the encoder fails.
Result<std::string> encode_jpeg(ImageView<const std::uint8_t> image, int quality);

/// Writes a single-channel PFM ("Pf"), little-endian, bottom row first; NaN (unknown) is written as +inf. Code
/// `output`.
Status write_pfm(const std::string& path, ImageView<const float> image);
/// Reads a single-channel PFM of either byte order; values that are not finite become NaN. Code `input`.
Result<Image<float>> read_pfm(const std::string& path);
Result<Image<float>> parse_pfm(const std::string& content, const std::string& name);

}  // namespace spartan
