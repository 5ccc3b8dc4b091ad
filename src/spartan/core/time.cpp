#include "spartan/core/time.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace spartan {
namespace {

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

tl::unexpected<Error> not_a_time(std::string_view text) {
  return failure(ErrorCode::input, fmt::format("'{}' is not a time in seconds", text));
}

}  // namespace

Stamp Stamp::from_seconds(double seconds) {
  return Stamp{std::llround(seconds * 1e9)};
}

std::string to_decimal_seconds(Stamp stamp) {
  const bool negative = stamp.ns < 0;
  const std::uint64_t magnitude =
      negative ? 0 - static_cast<std::uint64_t>(stamp.ns) : static_cast<std::uint64_t>(stamp.ns);
  const std::uint64_t whole = magnitude / kNanosecondsPerSecond;
  return fmt::format("{}{}.{:09}", negative ? "-" : "", whole, magnitude % kNanosecondsPerSecond);
}

Result<Stamp> parse_decimal_seconds(std::string_view text) {
  if (text.find_first_of("eE") != std::string_view::npos) {
    constexpr double kMaxSeconds = 9.2e9;  // range of int64 nanoseconds
    double seconds = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seconds);
    if (error != std::errc{} || end != text.data() + text.size() || !(std::abs(seconds) < kMaxSeconds)) {
      return not_a_time(text);
    }
    return Stamp::from_seconds(seconds);
  }
  std::string_view digits = text;
  const bool negative = !digits.empty() && digits.front() == '-';
  if (!digits.empty() && (digits.front() == '-' || digits.front() == '+')) digits.remove_prefix(1);
  // Accumulated with the sign of the result, because the negative range is larger by one.
  std::int64_t ns = 0;
  const auto append_digit = [&](int digit) {
    return !__builtin_mul_overflow(ns, std::int64_t{10}, &ns) &&
           !__builtin_add_overflow(ns, static_cast<std::int64_t>(negative ? -digit : digit), &ns);
  };
  int decimals = -1;  // −1: before the decimal point
  bool any = false;
  for (const char c : digits) {
    if (c == '.' && decimals < 0) {
      decimals = 0;
      continue;
    }
    if (c < '0' || c > '9') return not_a_time(text);
    any = true;
    if (decimals >= 9) continue;  // below a nanosecond
    if (!append_digit(c - '0')) return not_a_time(text);
    if (decimals >= 0) ++decimals;
  }
  if (!any) return not_a_time(text);
  for (int d = decimals < 0 ? 0 : decimals; d < 9; ++d) {
    if (!append_digit(0)) return not_a_time(text);
  }
  return Stamp{ns};
}

}  // namespace spartan
