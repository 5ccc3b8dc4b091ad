#include "bindings/pixel_format.h"

#include <fmt/format.h>
#include <nanobind/nanobind.h>

#include <array>

namespace spartan::python {

PixelFormat pixel_format(const std::string& layout, int bits, const std::string& alignment) {
  constexpr std::array kLayouts{PixelLayout::gray,       PixelLayout::rgb,        PixelLayout::bayer_rggb,
                                PixelLayout::bayer_grbg, PixelLayout::bayer_gbrg, PixelLayout::bayer_bggr};
  if (bits < 8 || bits > 16) throw nanobind::value_error(fmt::format("bits = {}: must be 8 to 16", bits).c_str());
  if (alignment != "low" && alignment != "high")
    throw nanobind::value_error(fmt::format("alignment = '{}': must be low or high", alignment).c_str());
  std::string names;
  for (const PixelLayout each : kLayouts) {
    if (name_of(each) == layout) return {each, bits, alignment == "high" ? BitAlignment::high : BitAlignment::low};
    names += (names.empty() ? "" : ", ") + std::string(name_of(each));
  }
  throw nanobind::value_error(fmt::format("layout = '{}': must be one of {}", layout, names).c_str());
}

std::string alignment_name(const PixelFormat& format) {
  return format.alignment == BitAlignment::high ? "high" : "low";
}

}  // namespace spartan::python
