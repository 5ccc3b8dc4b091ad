// Tables in text files, read a line at a time.
#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <istream>
#include <memory>
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
  std::string header;              ///< names of the columns, must be the first row; empty: there is none
  bool ends_with_newline = false;  ///< true: a last line without one was broken off
};

/// Reads rows in constant memory. Empty lines and lines that begin with '#' do not count; blanks around fields,
/// carriage returns and a byte-order mark are taken off.
class TableReader {
 public:
  /// Code `input` where the file cannot be read or has another header.
  static Result<TableReader> open(const std::string& path, TableFormat format);
  /// The same over text in memory; `name` stands in errors.
  static Result<TableReader> over(std::string text, const std::string& name, TableFormat format);

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
  static Result<TableReader> begin(std::string path, TableFormat format, std::unique_ptr<std::istream> stream);
  TableReader(std::string path, TableFormat format, std::unique_ptr<std::istream> stream)
      : path_(std::move(path)), format_(std::move(format)), stream_(std::move(stream)) {}
  std::string path_;
  TableFormat format_;
  std::unique_ptr<std::istream> stream_;
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
