#include "spartan/image_io/image_io.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>
#include <type_traits>
#include <vector>

#include "spartan/core/files.h"
#include "spartan/image_io/internal/image_file_check.h"
#include "spartan/image_io/internal/jpeg_file.h"
#include "spartan/image_io/internal/png_file.h"
#include "spartan/image_io/internal/pnm_file.h"

namespace spartan {

using namespace internal;

namespace {

bool is_jpeg(std::string_view content) {
  return content.starts_with("\xFF\xD8");
}
bool is_pnm(std::string_view content) {
  return content.starts_with('P');
}

// The JPEG decoder reports a failed allocation as a damaged file. So if it fails it gets a second try, after this much
// memory was seen to be there: what fails again is damaged. Throws std::bad_alloc if it is not there.
constexpr std::size_t kDecoderMemory_bytes = std::size_t{64} << 20U;

Result<FrameImage> decode_jpeg_file(const std::string& content, JpegColour colour) {
  auto image = decode_jpeg(content, colour);
  if (image) return image;
  {
    std::vector<std::uint8_t> probe(kDecoderMemory_bytes);
    static_cast<volatile std::uint8_t&>(probe.back()) = 1;  // keeps the compiler from removing the allocation
  }
  return decode_jpeg(content, colour);
}

// The upper 8 of 16 bits; the luma of colour (Rec. 601) with weights of 14 bits.
Image<std::uint8_t> gray8_of(const FrameImage& image) {
  Image<std::uint8_t> gray(image.size());
  const auto convert = [&gray](const auto& view, const auto& value_of) {
    for (int y = 0; y < gray.height(); ++y)
      std::transform(view.row(y), view.row(y) + view.width(), gray.row(y), value_of);
  };
  constexpr auto kUpper = [](std::uint16_t value) { return static_cast<std::uint8_t>(value >> 8U); };
  constexpr auto kLuma = [](unsigned r, unsigned g, unsigned b) {
    return static_cast<std::uint8_t>((4899 * r + 9617 * g + 1868 * b + 8192) >> 14U);
  };
  const bool deep = image.format().bits > 8;
  if (image.format().layout == PixelLayout::gray && deep) {
    convert(image.as<std::uint16_t>(), kUpper);
  } else if (image.format().layout == PixelLayout::gray) {
    convert(image.as<std::uint8_t>(), [](std::uint8_t value) { return value; });
  } else if (deep) {
    convert(image.as<Rgb16>(), [&](const Rgb16& p) { return kLuma(kUpper(p.r), kUpper(p.g), kUpper(p.b)); });
  } else {
    convert(image.as<Rgb8>(), [&](const Rgb8& p) { return kLuma(p.r, p.g, p.b); });
  }
  return gray;
}

template <class Pixel>
std::string png_of(const ImageView<const Pixel>& image) {
  constexpr bool kRgb = std::is_same_v<Pixel, Rgb8> || std::is_same_v<Pixel, Rgb16>;
  return internal::encode_png({image.data(), image.size(), static_cast<std::size_t>(image.stride()) * sizeof(Pixel),
                               static_cast<int>(8 * sizeof(Pixel) / (kRgb ? 3 : 1)), kRgb});
}

// The next word of the PFM header "Pf\n<width> <height>\n<scale>\n"; removes it and its separator from `rest`.
std::string_view next_word(std::string_view& rest) {
  const std::size_t begin = rest.find_first_not_of(" \t\r\n");
  if (begin == std::string_view::npos) return rest = {};
  const std::size_t end = rest.find_first_of(" \t\r\n", begin);
  if (end == std::string_view::npos) return rest = {};
  const std::string_view word = rest.substr(begin, end - begin);
  rest.remove_prefix(end + 1);
  return word;
}

template <class T>
bool parse(std::string_view word, T& value) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc{} && end == word.data() + word.size();
}

}  // namespace

Result<FrameImage> decode_image(const std::string& content, const std::string& name) {
  const char* const hint = "replace the file, or remove it to skip the frame";
  if (const std::string error = image_file_error(content); !error.empty())
    return failure(ErrorCode::input, error, name, hint);
  if (is_jpeg(content)) {
    auto image = decode_jpeg_file(content, JpegColour::as_stored);
    if (!image) return failure(image.error().code, image.error().what, name, hint);
    return image;
  }
  auto image = is_pnm(content) ? decode_pnm(content) : decode_png(content, PngColour::as_stored);
  if (!image) return failure(image.error().code, image.error().what, name, hint);
  return image;
}

Result<FrameImage> read_image(const std::string& path) {
  const auto content = read_file(path);
  if (!content) return failure(content);
  return decode_image(*content, path);
}

Result<Image<std::uint8_t>> read_gray8(const std::string& path) {
  const auto content = read_file(path);
  if (!content) return failure(content);
  if (const std::string error = image_file_error(*content); !error.empty())
    return failure(ErrorCode::input, error, path);
  const auto image = is_jpeg(*content)  ? decode_jpeg_file(*content, JpegColour::gray)
                     : is_pnm(*content) ? decode_pnm(*content)
                                        : decode_png(*content, PngColour::gray);
  if (!image) return failure(image.error().code, image.error().what, path);
  return gray8_of(*image);
}

Result<std::string> encode_png(ImageView<const std::uint8_t> image) {
  return png_of(image);
}
Result<std::string> encode_png(ImageView<const Rgb8> image) {
  return png_of(image);
}

std::string to_png(const FrameImage& image) {
  const bool deep = image.format().bits > 8;
  if (image.format().layout == PixelLayout::rgb) return deep ? png_of(image.as<Rgb16>()) : png_of(image.as<Rgb8>());
  return deep ? png_of(image.as<std::uint16_t>()) : png_of(image.as<std::uint8_t>());
}

std::string to_pnm(const FrameImage& image) {
  const bool deep = image.format().bits > 8, rgb = image.format().layout == PixelLayout::rgb;
  std::string file = std::string(rgb ? "P6" : "P5") + "\n" + std::to_string(image.width()) + " " +
                     std::to_string(image.height()) + "\n" + (deep ? "65535" : "255") + "\n";
  file.reserve(file.size() + image.bytes());
  const auto append = [&file, &image]<class Pixel>(ImageView<const Pixel> pixels) {
    for (int y = 0; y < image.height(); ++y) {
      file.append(reinterpret_cast<const char*>(&pixels(0, y)),
                  static_cast<std::size_t>(image.width()) * sizeof(Pixel));
    }
  };
  const std::size_t header = file.size();
  if (rgb) {
    deep ? append(image.as<Rgb16>()) : append(image.as<Rgb8>());
  } else {
    deep ? append(image.as<std::uint16_t>()) : append(image.as<std::uint8_t>());
  }
  if (deep && std::endian::native == std::endian::little) {
    for (std::size_t i = header; i + 1 < file.size(); i += 2) std::swap(file[i], file[i + 1]);
  }
  return file;
}

Status write_png(const std::string& path, ImageView<const std::uint8_t> image) {
  return write_file_atomically(path, png_of(image));
}
Status write_png(const std::string& path, ImageView<const std::uint16_t> image) {
  return write_file_atomically(path, png_of(image));
}
Status write_png(const std::string& path, ImageView<const Rgb8> image) {
  return write_file_atomically(path, png_of(image));
}
Status write_png(const std::string& path, ImageView<const Rgb16> image) {
  return write_file_atomically(path, png_of(image));
}

Status write_pfm(const std::string& path, ImageView<const float> image) {
  std::string content = "Pf\n" + std::to_string(image.width()) + " " + std::to_string(image.height()) + "\n-1.0\n";
  content.reserve(content.size() +
                  sizeof(float) * static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()));
  for (int y = image.height() - 1; y >= 0; --y) {
    for (int x = 0; x < image.width(); ++x) {
      const float value = std::isnan(image(x, y)) ? std::numeric_limits<float>::infinity() : image(x, y);
      content.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
  }
  return write_file_atomically(path, content);
}

Result<Image<float>> parse_pfm(const std::string& content, const std::string& name) {
  std::string_view rest = content;
  const std::string_view magic = next_word(rest);
  const std::string_view width_text = next_word(rest), height_text = next_word(rest), scale_text = next_word(rest);
  std::size_t width = 0, height = 0;
  double scale = 0;
  if (magic != "Pf" || !parse(width_text, width) || !parse(height_text, height) || !parse(scale_text, scale) ||
      width == 0 || height == 0 || width > kMaxImageSide || height > kMaxImageSide || scale == 0 ||
      !std::isfinite(scale)) {
    return failure(ErrorCode::input, "is not a single-channel PFM file", name);
  }
  if (rest.size() < width * height * sizeof(float)) return failure(ErrorCode::input, "PFM file is truncated", name);
  Image<float> image(static_cast<int>(width), static_cast<int>(height));
  for (int y = image.height() - 1; y >= 0; --y) {
    for (int x = 0; x < image.width(); ++x, rest.remove_prefix(sizeof(float))) {
      std::uint32_t bits = 0;
      std::memcpy(&bits, rest.data(), sizeof bits);
      if (scale > 0) bits = __builtin_bswap32(bits);
      const auto value = std::bit_cast<float>(bits);
      image(x, y) = std::isfinite(value) ? value : std::numeric_limits<float>::quiet_NaN();
    }
  }
  return image;
}

Result<Image<float>> read_pfm(const std::string& path) {
  const auto content = read_file(path);
  if (!content) return failure(content);
  return parse_pfm(*content, path);
}

}  // namespace spartan
