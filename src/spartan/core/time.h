// Time stamps. Time comes with the data; no result of the library depends on a clock.
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <string_view>

#include "spartan/core/result.h"

namespace spartan {

/// A time in nanoseconds since the epoch of the recording (mid-exposure for images).
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

/// Seconds with nine decimals ("12.000000345"), exact.
std::string to_decimal_seconds(Stamp stamp);

/// Parses decimal seconds ("1.5", "-0.25", "1403715273.262142976", "1.2e3"). Without an exponent the result is exact;
/// digits below a nanosecond are cut off. Code `input`.
Result<Stamp> parse_decimal_seconds(std::string_view text);

}  // namespace spartan
