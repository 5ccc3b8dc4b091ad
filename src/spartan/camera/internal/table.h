// Tables in text files (CSV or blank-separated), read line by line.
#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "spartan/camera/internal/line_reader.h"
#include "spartan/core/result.h"
#include "spartan/core/time.h"

namespace spartan::internal {

/// Syntax of a table.
struct TableFormat {
  char separator = ',';            ///< ' ': any run of blanks
  std::string header;              ///< expected column names in the first row; empty: no header
  std::string required{};          ///< the first row need not hold more of the names than these; empty: all of them
  bool ends_with_newline = false;  ///< true: a last line without a newline is an error (truncated file)
};

/// Reads rows in constant memory. Skips empty lines and lines that start with '#'; strips blanks around fields,
/// carriage returns and a byte-order mark.
class TableReader {
 public:
  /// Opens a file. Codes as read_file(); `input` where its header differs.
  static Result<TableReader> open(const std::string& path, TableFormat format);
  /// Reads text in memory; errors call it `name`.
  static Result<TableReader> over(std::string text, const std::string& name, TableFormat format);

  /// The fields of the next row, valid until the next call; nothing at the end. Codes: `input` for a row that is too
  /// long or truncated, after which reading can go on with the row behind it; `read_error` and `resources` end the
  /// table.
  Result<std::optional<std::vector<std::string_view>>> next();
  /// The same; a row with fewer than `fields` fields is an error of code `input`.
  Result<std::optional<std::vector<std::string_view>>> next(std::size_t fields);

  const std::string& path() const { return path_; }
  /// "file:line" of the row that next() returned last.
  std::string location() const { return path_ + ":" + std::to_string(line_number_); }
  /// The place in a row of each column of TableFormat::header; none where the file does not have it.
  const std::vector<std::optional<std::size_t>>& columns() const { return columns_; }
  /// Whether the file has all of them, in their order.
  bool has_all_columns() const { return has_all_columns_; }
  /// An error of code `input` at the row that next() returned last.
  tl::unexpected<Error> error_in_row(std::string what) const {
    return failure(ErrorCode::input, std::move(what), location());
  }

 private:
  static Result<TableReader> begin(std::string path, TableFormat format, LineReader lines);
  TableReader(std::string path, TableFormat format, LineReader lines)
      : path_(std::move(path)), format_(std::move(format)), lines_(std::move(lines)) {}
  std::string path_;
  TableFormat format_;
  LineReader lines_;
  std::string_view line_;  // the current one, without blanks at its ends
  int line_number_ = 0;
  std::vector<std::optional<std::size_t>> columns_;
  bool has_all_columns_ = true;
};

/// The fields of a row, without blanks around them. `separator` as in TableFormat.
std::vector<std::string_view> split(std::string_view row, char separator);

/// Parses all of `text` as a number; nothing where it is not a number or not finite.
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

/// Whether the stamp is within ±146 years of the epoch, so that differences of stamps do not overflow.
bool is_in_range(Stamp stamp);
/// Parses a stamp in nanoseconds; nothing where it is not an integer or out of range.
std::optional<Stamp> parse_stamp_ns(std::string_view text);

/// Formats radians as decimal degrees with the fewest digits from which parse_degrees() recovers the same double.
std::string to_degrees(double radians);
/// Converts decimal degrees to radians in long double (64-bit mantissa or more), rounded once.
std::optional<double> parse_degrees(std::string_view text);

}  // namespace spartan::internal
