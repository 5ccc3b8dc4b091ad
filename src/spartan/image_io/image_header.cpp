// Image size from the header of an image file, without decoding it.

#include <algorithm>
#include <cstdint>
#include <string_view>

#include "spartan/core/files.h"
#include "spartan/image_io/image_io.h"
#include "spartan/image_io/internal/pnm_file.h"

namespace spartan {

using namespace internal;

namespace {

using std::string_view_literals::operator""sv;

constexpr std::size_t kHeaderBytes = 1 << 18;  // a JPEG may hold several 64-KiB metadata segments before the size
constexpr int kLargestSide = 32768;            // px; larger sizes are taken as damaged headers

// Unsigned big-endian number; 0 where it is larger than kLargestSide.
int side_of(std::string_view bytes) {
  std::uint32_t value = 0;
  for (const char c : bytes) value = (value << 8U) | static_cast<std::uint8_t>(c);
  return value > static_cast<std::uint32_t>(kLargestSide) ? 0 : static_cast<int>(value);
}

// The IHDR chunk is the first one: width and height at bytes 16 and 20.
ImageSize png_size(std::string_view head) {
  if (head.size() < 24) return {};
  return {side_of(head.substr(16, 4)), side_of(head.substr(20, 4))};
}

// Skips segments up to the start-of-frame marker (C0 to CF except C4, C8 and CC), which holds height and width.
ImageSize jpeg_size(std::string_view head) {
  std::size_t at = 2;
  while (at + 9 <= head.size() && head[at] == '\xFF') {
    const auto marker = static_cast<std::uint8_t>(head[at + 1]);
    if (marker == 0xFF) {
      ++at;
      continue;
    }
    if (marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC) {
      return {side_of(head.substr(at + 7, 2)), side_of(head.substr(at + 5, 2))};
    }
    const auto high = static_cast<std::uint8_t>(head[at + 2]), low = static_cast<std::uint8_t>(head[at + 3]);
    at += 2 + static_cast<std::size_t>(high) * 256 + low;
  }
  return {};
}

ImageSize pnm_size(const PnmHeader& header) {
  if (std::max(header.width, header.height) > static_cast<std::size_t>(kLargestSide)) return {};
  return {static_cast<int>(header.width), static_cast<int>(header.height)};
}

}  // namespace

std::optional<ImageSize> read_image_size(const std::string& path) {
  const auto content = read_beginning(path, kHeaderBytes);
  return content ? parse_image_size(*content) : std::nullopt;
}

std::optional<ImageSize> parse_image_size(std::string_view head) {
  ImageSize size;
  if (head.starts_with("\x89PNG\r\n\x1a\n"sv)) size = png_size(head);
  if (head.starts_with("\xFF\xD8"sv)) size = jpeg_size(head);
  if (const auto pnm = parse_pnm_header(head)) size = pnm_size(*pnm);
  if (size.empty()) return std::nullopt;
  return size;
}

}  // namespace spartan
