// Image files: PNG, JPEG, PGM/PPM in; PNG, PFM out.
#pragma once

#include <string>

#include "spartan/core/frame_image.h"
#include "spartan/core/result.h"

namespace spartan {

/// Decodes a picture file into gray or RGB of 8 or 16 bits (`format.bits` is 8 or 16; a recording that knows
/// better says so by `with_format`). A file that is missing, empty, truncated (PNG without its end chunk,
/// JPEG without its end marker, or with damage that its decoder notices) or no picture of these kinds gives an error
/// with code `input` that names the path and what is wrong.
Result<FrameImage> read_image(const std::string& path);

/// The same from memory; `name` stands in errors.
Result<FrameImage> decode_image(const std::string& content, const std::string& name);

/// Gray, whatever the file holds (colour by Rec. 601 luma), reduced to 8 bits.
Result<Image<std::uint8_t>> read_gray8(const std::string& path);

/// 8- or 16-bit gray or RGB PNG, written atomically; code `output`.
Status write_png(const std::string& path, ImageView<const std::uint8_t> image);
Status write_png(const std::string& path, ImageView<const std::uint16_t> image);
Status write_png(const std::string& path, ImageView<const Rgb8> image);
Status write_png(const std::string& path, ImageView<const Rgb16> image);

/// A PNG file's content.
Result<std::string> encode_png(ImageView<const std::uint8_t> image);
Result<std::string> encode_png(ImageView<const Rgb8> image);

/// Single-channel PFM ("Pf"), little endian, bottom row first; NaN is written as +inf (unknown).
Status write_pfm(const std::string& path, ImageView<const float> image);
/// Reads "Pf" of either byte order; +inf becomes NaN.
Result<Image<float>> read_pfm(const std::string& path);
Result<Image<float>> parse_pfm(const std::string& content, const std::string& name);

}  // namespace spartan
