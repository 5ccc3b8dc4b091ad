#include "spartan/figures/colours.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace spartan {
namespace {

std::uint8_t level(double value) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
}

}  // namespace

std::string hex(const Rgb8& colour) {
  return fmt::format("#{:02x}{:02x}{:02x}", colour.r, colour.g, colour.b);
}

Rgb8 cold_to_hot(double value) {
  const double v = std::clamp(value, 0.0, 1.0);
  return v < 0.5 ? Rgb8{level(0.2 + 1.6 * v), level(0.35 + 1.3 * v), level(0.75 + 0.5 * v)}
                 : Rgb8{level(1.1 - 0.3 * (v - 0.5)), level(1 - 1.6 * (v - 0.5)), level(1 - 1.9 * (v - 0.5))};
}

}  // namespace spartan
