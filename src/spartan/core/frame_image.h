// A camera's image of any pixel format, owned or borrowed.
#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string_view>

#include "spartan/core/image.h"

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

/// One image as a camera delivers it. Copies are cheap: they share the pixels, which are immutable.
/// It either shares ownership of its pixels or borrows memory that the caller keeps alive.
class FrameImage {
 public:
  FrameImage() = default;

  /// Borrows the pixels; the caller keeps the memory alive and unchanged while any copy is in use. Throws
  /// std::invalid_argument if the pixel type does not match the format.
  template <class Pixel>
  static FrameImage borrow(ImageView<const Pixel> view, PixelFormat format) {
    check<Pixel>(format);
    FrameImage image;
    image.format_ = format;
    image.size_ = view.size();
    image.data_ = view.data();
    image.stride_bytes_ = view.stride() * static_cast<std::ptrdiff_t>(sizeof(Pixel));
    return image;
  }
  /// Takes ownership of the pixels; throws as borrow().
  template <class Pixel>
  static FrameImage own(Image<Pixel> pixels, PixelFormat format) {
    auto owner = std::make_shared<const Image<Pixel>>(std::move(pixels));
    FrameImage image = borrow(owner->view(), format);
    image.owner_ = std::move(owner);
    return image;
  }
  /// Shares pixels that `owner` keeps alive and unchanged, such as a buffer of a camera or a part of an image; throws
  /// as borrow().
  template <class Pixel>
  static FrameImage share(ImageView<const Pixel> view, PixelFormat format, std::shared_ptr<const void> owner) {
    FrameImage image = borrow(view, format);
    image.owner_ = std::move(owner);
    return image;
  }

  /// The same pixels with another format (Bayer phase, number of bits); throws std::invalid_argument if the number of
  /// channels or bytes per sample differs.
  FrameImage with_format(PixelFormat format) const {
    if ((format.layout == PixelLayout::rgb) != (format_.layout == PixelLayout::rgb) ||
        format.bytes_per_sample() != format_.bytes_per_sample()) {
      throw std::invalid_argument("FrameImage::with_format: the pixel types differ");
    }
    FrameImage image = *this;
    image.format_ = format;
    return image;
  }

  const PixelFormat& format() const { return format_; }
  ImageSize size() const { return size_; }
  int width() const { return size_.width; }
  int height() const { return size_.height; }
  bool empty() const { return size_.empty(); }
  /// Memory of the pixels.
  std::size_t bytes() const {
    return static_cast<std::size_t>(size_.width) * static_cast<std::size_t>(size_.height) *
           static_cast<std::size_t>(format_.bytes_per_sample() * (format_.layout == PixelLayout::rgb ? 3 : 1));
  }

  /// The pixels as uint8_t, uint16_t, Rgb8 or Rgb16; throws std::invalid_argument if they have another type.
  template <class Pixel>
  ImageView<const Pixel> as() const {
    check<Pixel>(format_);
    return {static_cast<const Pixel*>(data_), size_.width, size_.height,
            stride_bytes_ / static_cast<std::ptrdiff_t>(sizeof(Pixel))};
  }

 private:
  template <class Pixel>
  static void check(PixelFormat format) {
    constexpr bool colour = std::is_same_v<Pixel, Rgb8> || std::is_same_v<Pixel, Rgb16>;
    constexpr int bytes = colour ? sizeof(Pixel) / 3 : sizeof(Pixel);
    if (colour != (format.layout == PixelLayout::rgb) || bytes != format.bytes_per_sample()) {
      throw std::invalid_argument("FrameImage: the pixel type does not match the pixel format");
    }
  }

  PixelFormat format_;
  ImageSize size_;
  const void* data_ = nullptr;
  std::ptrdiff_t stride_bytes_ = 0;
  std::shared_ptr<const void> owner_;
};

}  // namespace spartan
