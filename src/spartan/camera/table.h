// Tables in text files, read a line at a time.
#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/core/time.h"

namespace spartan {

/// How a table is written.
struct TableFormat {
  char separator = ',';            ///< ' ': any run of blanks
  std::string header;              ///< must be the first line; empty: lines beginning with '#' are comments
  bool ends_with_newline = false;  ///< true: a last line without one was broken off
};

/// Reads rows in constant memory. Empty lines do not count; blanks around fields and carriage returns are taken off.
class TableReader {
 public:
  /// Code `input` where the file cannot be read or has another header.
  static Result<TableReader> open(const std::string& path, TableFormat format);

  /// The fields of the next row, valid until the next call; nothing at the end.
  Result<std::optional<std::vector<std::string_view>>> next();
  /// The same, for a table whose rows have at least `fields` fields: fewer are an error of code `input`.
  Result<std::optional<std::vector<std::string_view>>> next(std::size_t fields);

  const std::string& path() const { return path_; }
  /// "file:line" of the row that next() gave last.
  std::string place() const { return path_ + ":" + std::to_string(line_number_); }
  /// An error of code `input` at the row that next() gave last.
  tl::unexpected<Error> fault(std::string what) const { return failure(ErrorCode::input, std::move(what), place()); }

 private:
  TableReader(std::string path, TableFormat format) : path_(std::move(path)), format_(std::move(format)) {}
  std::string path_;
  TableFormat format_;
  std::ifstream file_;
  std::string line_;
  int line_number_ = 0;
};

/// The whole of `text` as a number; nothing where it is none, or not finite.
template <class Number>
std::optional<Number> parse_number(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  if constexpr (std::is_floating_point_v<Number>) {
    if (!std::isfinite(value)) return std::nullopt;
  }
  return value;
}

/// Within ±146 years of the epoch, so that differences of stamps do not overflow.
bool is_sane(Stamp stamp);
/// A stamp in nanoseconds; nothing where it is none or not sane.
std::optional<Stamp> parse_stamp_ns(std::string_view text);

/// Radians in decimal degrees with the fewest digits from which parse_degrees() gives the same double.
std::string to_degrees(double radians);
/// Decimal degrees to radians, computed with 64 bits of mantissa or more and rounded once.
std::optional<double> parse_degrees(std::string_view text);

}  // namespace spartan
