#include "bindings/pixel_format.h"

#include <fmt/format.h>
#include <nanobind/nanobind.h>

#include <array>

namespace spartan::python {

PixelFormat pixel_format(const std::string& layout, int bits) {
  constexpr std::array kLayouts{PixelLayout::gray,       PixelLayout::rgb,        PixelLayout::bayer_rggb,
                                PixelLayout::bayer_grbg, PixelLayout::bayer_gbrg, PixelLayout::bayer_bggr};
  if (bits < 8 || bits > 16) throw nanobind::value_error(fmt::format("bits = {}: must be 8 to 16", bits).c_str());
  std::string names;
  for (const PixelLayout each : kLayouts) {
    if (name_of(each) == layout) return {each, bits, BitAlignment::low};
    names += (names.empty() ? "" : ", ") + std::string(name_of(each));
  }
  throw nanobind::value_error(fmt::format("layout = '{}': must be one of {}", layout, names).c_str());
}

}  // namespace spartan::python
