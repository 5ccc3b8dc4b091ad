#include "spartan/image_io/internal/pnm_file.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <charconv>
#include <cstring>
#include <limits>
#include <span>
#include <type_traits>

namespace spartan::internal {
namespace {

// Skips white space and comments, then reads a number; 0 if there is none.
std::size_t next_number(std::string_view& rest) {
  for (;;) {
    while (!rest.empty() && std::isspace(static_cast<unsigned char>(rest.front()))) rest.remove_prefix(1);
    if (rest.empty() || rest.front() != '#') break;
    rest.remove_prefix(std::min(rest.find('\n'), rest.size()));
  }
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (error != std::errc{}) return 0;
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  return value;
}

// A number of the text formats; nothing where there is none, or one that is too large.
template <class Sample>
std::optional<Sample> next_sample(std::string_view& rest) {
  const std::string_view before = rest;
  const std::size_t value = next_number(rest);
  const std::string_view used = before.substr(0, before.size() - rest.size());
  const bool is_number = !used.empty() && std::isdigit(static_cast<unsigned char>(used.back()));
  if (!is_number || value > std::numeric_limits<Sample>::max()) return std::nullopt;
  return static_cast<Sample>(value);
}

// Takes the samples of a row from `rest`; false if there are not enough.
template <class Sample>
bool read_row(bool binary, std::string_view& rest, std::span<Sample> row) {
  if (!binary) {
    for (Sample& sample : row) {
      const auto value = next_sample<Sample>(rest);
      if (!value) return false;
      sample = *value;
    }
    return true;
  }
  if (rest.size() < row.size_bytes()) return false;
  std::memcpy(row.data(), rest.data(), row.size_bytes());
  rest.remove_prefix(row.size_bytes());
  if constexpr (sizeof(Sample) == 2 && std::endian::native == std::endian::little) {  // the file is big-endian
    for (Sample& sample : row) sample = static_cast<Sample>((sample >> 8U) | (sample << 8U));
  }
  return true;
}

template <class Pixel, class Sample>
Result<FrameImage> decode_as(const PnmHeader& header) {
  Image<Pixel> image(static_cast<int>(header.width), static_cast<int>(header.height));
  std::string_view rest = header.samples;
  for (int y = 0; y < image.height(); ++y) {
    auto* const row = reinterpret_cast<Sample*>(image.row(y));
    if (!read_row<Sample>(header.binary, rest, {row, header.width * (header.colour ? 3 : 1)}))
      return failure(ErrorCode::input, "PGM/PPM file is damaged: a sample is missing or too large");
  }
  return FrameImage::own(std::move(image), {std::is_same_v<Pixel, Sample> ? PixelLayout::gray : PixelLayout::rgb,
                                            static_cast<int>(8 * sizeof(Sample)), BitAlignment::low});
}

}  // namespace

std::optional<PnmHeader> parse_pnm_header(std::string_view content) {
  if (content.size() < 3 || content[0] != 'P' || std::string_view("2356").find(content[1]) == std::string_view::npos ||
      !std::isspace(static_cast<unsigned char>(content[2]))) {
    return std::nullopt;
  }
  PnmHeader header;
  header.binary = content[1] == '5' || content[1] == '6';
  header.colour = content[1] == '3' || content[1] == '6';
  header.samples = content.substr(2);
  for (std::size_t* number : {&header.width, &header.height, &header.largest}) *number = next_number(header.samples);
  header.samples.remove_prefix(std::min<std::size_t>(header.samples.size(), 1));  // one white space
  return header;
}

Result<FrameImage> decode_pnm(std::string_view content) {
  const auto header = parse_pnm_header(content);
  if (!header) return failure(ErrorCode::input, "is not a PGM or PPM image");
  if (header->largest > 255)
    return header->colour ? decode_as<Rgb16, std::uint16_t>(*header) : decode_as<std::uint16_t, std::uint16_t>(*header);
  return header->colour ? decode_as<Rgb8, std::uint8_t>(*header) : decode_as<std::uint8_t, std::uint8_t>(*header);
}

}  // namespace spartan::internal
