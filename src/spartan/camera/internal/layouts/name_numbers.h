// Numbers in the names of image files: frame numbers or time stamps.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spartan/core/time.h"

namespace spartan::internal {

enum class StampUnit : std::uint8_t { seconds, milliseconds, microseconds, nanoseconds };
/// "seconds" ….
std::string_view name_of(StampUnit unit);

/// The number in each of a list of names.
struct NameNumbers {
  std::vector<std::int64_t> values;  ///< in the order of the names; nanoseconds where `decimal_seconds`
  bool decimal_seconds = false;      ///< "1403636579.763555", or seconds and nanoseconds "1403636579_763555584"
};

/// The numbers that tell the names (without extension) apart: "left_000012" → 12. Where names hold several numbers, the
/// longest that differs in all names counts. Nothing where there is none, or where names hold different numbers of
/// them.
std::optional<NameNumbers> numbers_in_names(const std::vector<std::string>& stems);

/// The unit in which integers state time, or nothing where they are frame numbers: all lie between the years 2001 and
/// 2100, or their median step is 1 to 200 frames per second (in milliseconds: and steps differ, since every tenth frame
/// looks the same).
std::optional<StampUnit> stamp_unit(std::vector<std::int64_t> values);

/// Nothing where the stamp would be out of range.
std::optional<Stamp> to_stamp(std::int64_t value, StampUnit unit);

}  // namespace spartan::internal
