// Pixel formats of camera images.
#pragma once

#include <cstdint>
#include <string_view>

namespace spartan {

/// Arrangement of the colour samples. A Bayer layout is named by its top-left 2×2 block, read row by row.
enum class PixelLayout : std::uint8_t { gray, rgb, bayer_rggb, bayer_grbg, bayer_gbrg, bayer_bggr };

/// Alignment of the significant bits inside a 16-bit word.
enum class BitAlignment : std::uint8_t { low, high };

/// 8-bit samples are stored in bytes, 9 to 16 bits in 16-bit words.
struct PixelFormat {
  PixelLayout layout = PixelLayout::gray;
  int bits = 8;  ///< significant bits per sample, 8 to 16
  BitAlignment alignment = BitAlignment::low;

  bool is_bayer() const { return layout != PixelLayout::gray && layout != PixelLayout::rgb; }
  int bytes_per_sample() const { return bits > 8 ? 2 : 1; }
  /// The largest value of a stored sample.
  int full_scale() const {
    const int low = (1 << bits) - 1;
    return alignment == BitAlignment::high && bits > 8 ? low << (16 - bits) : low;
  }
  friend bool operator==(const PixelFormat&, const PixelFormat&) = default;
};

/// The name in files: "gray", "rgb", "bayer_rggb" ….
std::string_view name_of(PixelLayout layout);

}  // namespace spartan
