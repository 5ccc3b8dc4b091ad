#include "spartan/image_io/image_io.h"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>
#include <vector>

#include "spartan/core/files.h"
#include "spartan/image_io/internal/image_file_check.h"
#include "spartan/image_io/internal/jpeg_file.h"
#include "spartan/image_io/opencv_bridge.h"

namespace spartan {

using namespace internal;

namespace {

bool is_jpeg(std::string_view content) {
  return content.starts_with("\xFF\xD8");
}

cv::Mat decode(const std::string& content, int flags) {
  const cv::Mat bytes(1, static_cast<int>(content.size()), CV_8UC1, const_cast<char*>(content.data()));
  try {
    return cv::imdecode(bytes, flags);
  } catch (const cv::Exception& e) {
    if (e.code == cv::Error::StsNoMem) throw std::bad_alloc();
    return {};
  }
}

// The decoders report a failed allocation as a damaged file. So a decoder that fails gets a second try, after this much
// memory was seen to be there: what fails again is damaged. Throws std::bad_alloc if it is not there.
constexpr std::size_t kDecoderMemory_bytes = std::size_t{64} << 20U;

template <class Decode>
auto decode_with_second_try(const Decode& decode_once) {
  auto image = decode_once();
  if (image) return image;
  {
    std::vector<std::uint8_t> probe(kDecoderMemory_bytes);
    static_cast<volatile std::uint8_t&>(probe.back()) = 1;  // keeps the compiler from removing the allocation
  }
  return decode_once();
}

Result<cv::Mat> decode_png_or_pnm(const std::string& content, int flags) {
  return decode_with_second_try([&]() -> Result<cv::Mat> {
    cv::Mat mat = decode(content, flags);
    if (mat.empty()) return failure(ErrorCode::input, "is damaged or cannot be decoded");
    return mat;
  });
}

Result<FrameImage> decode_jpeg_file(const std::string& content, JpegColour colour) {
  return decode_with_second_try([&] { return decode_jpeg(content, colour); });
}

template <class Pixel>
FrameImage own(cv::Mat& mat, PixelLayout layout) {
  return FrameImage::own(Image<Pixel>::copy_of(as_view<Pixel>(mat)),
                         {layout, mat.depth() == CV_16U ? 16 : 8, BitAlignment::low});
}

Result<std::string> png_of(const cv::Mat& mat) {
  std::vector<std::uint8_t> png;
  try {
    // The encoder fails for a failed allocation only, with false or an assertion: size and type of the image are valid.
    if (!cv::imencode(".png", mat, png)) throw std::bad_alloc();
  } catch (const cv::Exception& e) {
    if (e.code == cv::Error::StsNoMem || e.code == cv::Error::StsAssert) throw std::bad_alloc();
    return failure(ErrorCode::internal, "cannot encode the image as PNG: " + e.msg);
  }
  return std::string(png.begin(), png.end());
}

Result<std::string> png_of_rgb(const cv::Mat& rgb) {
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  return png_of(bgr);
}

Status write_encoded(const std::string& path, const Result<std::string>& png) {
  if (!png) return failure(ErrorCode::internal, png.error().what, path);
  return write_file_atomically(path, *png);
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
  const auto decoded = decode_png_or_pnm(content, cv::IMREAD_ANYDEPTH | cv::IMREAD_ANYCOLOR);
  if (!decoded) return failure(decoded.error().code, decoded.error().what, name, hint);
  cv::Mat mat = *decoded;
  if (mat.channels() == 3) cv::cvtColor(mat, mat, cv::COLOR_BGR2RGB);
  switch (mat.type()) {
    case CV_8UC1:
      return own<std::uint8_t>(mat, PixelLayout::gray);
    case CV_16UC1:
      return own<std::uint16_t>(mat, PixelLayout::gray);
    case CV_8UC3:
      return own<Rgb8>(mat, PixelLayout::rgb);
    case CV_16UC3:
      return own<Rgb16>(mat, PixelLayout::rgb);
    default:
      return failure(ErrorCode::input, "has neither 8 nor 16 bits per sample", name);
  }
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
  if (is_jpeg(*content)) {
    const auto image = decode_jpeg_file(*content, JpegColour::gray);
    if (!image) return failure(image.error().code, image.error().what, path);
    return Image<std::uint8_t>::copy_of(image->as<std::uint8_t>());
  }
  const auto mat = decode_png_or_pnm(*content, cv::IMREAD_GRAYSCALE);
  if (!mat) return failure(mat.error().code, mat.error().what, path);
  return Image<std::uint8_t>::copy_of(as_view<std::uint8_t>(*mat));
}

Result<std::string> encode_png(ImageView<const std::uint8_t> image) {
  return png_of(as_mat(image));
}
Result<std::string> encode_png(ImageView<const Rgb8> image) {
  return png_of_rgb(as_mat(image));
}

Status write_png(const std::string& path, ImageView<const std::uint8_t> image) {
  return write_encoded(path, png_of(as_mat(image)));
}
Status write_png(const std::string& path, ImageView<const std::uint16_t> image) {
  return write_encoded(path, png_of(as_mat(image)));
}
Status write_png(const std::string& path, ImageView<const Rgb8> image) {
  return write_encoded(path, png_of_rgb(as_mat(image)));
}
Status write_png(const std::string& path, ImageView<const Rgb16> image) {
  return write_encoded(path, png_of_rgb(as_mat(image)));
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
