#include "spartan/image_io/internal/image_file_check.h"

#include <cstdint>
#include <limits>

#include "spartan/image_io/internal/pnm_file.h"

namespace spartan::internal {
namespace {

using std::string_view_literals::operator""sv;

constexpr auto kPngMagic = "\x89PNG\r\n\x1a\n"sv;
constexpr auto kJpegMagic = "\xFF\xD8"sv;

std::uint8_t byte(std::string_view bytes, std::size_t at) {
  return static_cast<std::uint8_t>(bytes[at]);
}

std::uint32_t big_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (const char c : bytes) value = (value << 8U) | static_cast<std::uint8_t>(c);
  return value;
}

bool is_plausible(std::size_t width, std::size_t height) {
  return width > 0 && height > 0 && width <= kMaxImageSide && height <= kMaxImageSide &&
         width * height <= kMaxImagePixels;
}

std::string png_error(std::string_view png) {
  std::size_t at = kPngMagic.size();
  while (at + 12 <= png.size()) {  // length, type, data, checksum
    const std::size_t length = big_endian(png.substr(at, 4));
    const std::string_view type = png.substr(at + 4, 4);
    if (length > png.size() - at - 12) return "PNG file is truncated";
    if (type == "IHDR"sv && length >= 8 &&
        !is_plausible(big_endian(png.substr(at + 8, 4)), big_endian(png.substr(at + 12, 4)))) {
      return "PNG header with an implausible image size";
    }
    if (type == "IEND"sv) return {};
    at += 12 + length;
  }
  return "PNG file is truncated";
}

// Markers of a JPEG file (T.81 table B.1).
enum JpegMarker : std::uint8_t { kTemporary = 0x01, kRestart0 = 0xD0, kRestart7 = 0xD7, kEnd = 0xD9, kScan = 0xDA };

bool is_restart(std::uint8_t marker) {
  return marker >= kRestart0 && marker <= kRestart7;
}
bool is_frame_header(std::uint8_t marker) {  // SOF0 … SOF15 without DHT, JPG, DAC
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

// The end of the entropy-coded data that begins at `at`: the first marker that is not a restart. Inside the data a
// byte 0xFF is always followed by a stuffed 0.
std::size_t end_of_scan(std::string_view jpeg, std::size_t at) {
  for (; at + 1 < jpeg.size(); ++at) {
    if (byte(jpeg, at) != 0xFF) continue;
    const std::uint8_t next = byte(jpeg, at + 1);
    if (next != 0 && next != 0xFF && !is_restart(next)) return at;
  }
  return jpeg.size();
}

// A progressive JPEG has several scans with tables between them, and one end marker after the last scan.
std::string jpeg_error(std::string_view jpeg) {
  constexpr const char *truncated = "JPEG file is truncated", *damaged = "JPEG file is damaged";
  std::size_t at = kJpegMagic.size();
  bool any_scan = false;
  while (at + 2 <= jpeg.size()) {
    if (byte(jpeg, at) != 0xFF) return damaged;
    const std::uint8_t marker = byte(jpeg, at + 1);
    if (marker == 0xFF) {  // fill byte
      ++at;
      continue;
    }
    if (marker == kEnd) return any_scan ? std::string{} : "JPEG file without image data";
    if (marker == kTemporary || is_restart(marker)) {
      at += 2;
      continue;
    }
    if (at + 4 > jpeg.size()) return truncated;
    const std::size_t length = big_endian(jpeg.substr(at + 2, 2));
    if (length < 2) return damaged;
    if (length > jpeg.size() - at - 2) return truncated;
    if (is_frame_header(marker)) {
      if (length < 8) return damaged;
      if (!is_plausible(big_endian(jpeg.substr(at + 7, 2)), big_endian(jpeg.substr(at + 5, 2)))) {
        return "JPEG header with an implausible image size";
      }
    }
    at += 2 + length;
    if (marker != kScan) continue;
    any_scan = true;
    at = end_of_scan(jpeg, at);
  }
  return truncated;
}

std::string pnm_error(const PnmHeader& header) {
  if (!is_plausible(header.width, header.height) || header.largest == 0 || header.largest > 65535)
    return "PGM/PPM header is invalid";
  // In the text formats every sample but the last takes at least two characters.
  const std::size_t samples = header.width * header.height * (header.colour ? 3 : 1);
  const std::size_t least = header.binary ? samples * (header.largest > 255 ? 2 : 1) : 2 * samples - 1;
  return header.samples.size() < least ? "PGM/PPM file is truncated" : "";
}

}  // namespace

std::string image_file_error(std::string_view content) {
  if (content.empty()) return "file is empty";
  if (content.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) return "file is too large";
  if (content.starts_with(kPngMagic)) return png_error(content);
  if (content.starts_with(kJpegMagic)) return jpeg_error(content);
  if (const auto pnm = parse_pnm_header(content)) return pnm_error(*pnm);
  return "is not a PNG, JPEG, PGM or PPM image";
}

}  // namespace spartan::internal
