// Time stamps. Time comes in with the data; nothing in the library reads a clock for its results.
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <string_view>

#include "spartan/core/result.h"

namespace spartan {

/// A moment in nanoseconds since the recording's own epoch (mid-exposure for images).
struct Stamp {
  std::int64_t ns = 0;

  static Stamp from_seconds(double seconds);
  double seconds() const { return static_cast<double>(ns) * 1e-9; }
  friend auto operator<=>(const Stamp&, const Stamp&) = default;
};

/// Seconds from `from` to `to`; exact to the nanosecond for spans under 100 days.
inline double seconds_between(Stamp from, Stamp to) {
  return static_cast<double>(to.ns - from.ns) * 1e-9;
}

/// "12.000000345": seconds with nine decimals, without rounding.
std::string to_decimal_seconds(Stamp stamp);

/// Reads decimal seconds ("1.5", "-0.25", "1403715273.262142976", "1.2e3") without losing nanoseconds.
Result<Stamp> parse_decimal_seconds(std::string_view text);

}  // namespace spartan
