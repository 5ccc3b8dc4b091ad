#include "spartan/camera/internal/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numbers>

namespace spartan::internal {
namespace {

// Half of the range: the difference of two stamps fits 64 bits.
constexpr std::int64_t kLargestStamp = std::numeric_limits<std::int64_t>::max() / 2;
constexpr std::string_view kBlanks = " \t\r";
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

std::string_view trim(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

std::optional<std::size_t> index_of(const std::vector<std::string_view>& names, std::string_view name) {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? std::nullopt : std::optional(static_cast<std::size_t>(found - names.begin()));
}

// Quotes file content in an error message: at most 80 characters, non-printable ones replaced.
std::string quote(std::string_view text) {
  std::string quoted;
  for (const char c : text.substr(0, 80)) quoted += c >= ' ' && c <= '~' ? c : '?';
  return "'" + quoted + (text.size() > 80 ? "…'" : "'");
}

}  // namespace

std::vector<std::string_view> split(std::string_view row, char separator) {
  std::vector<std::string_view> fields;
  for (;;) {
    const std::size_t end = separator == ' ' ? row.find_first_of(kBlanks) : row.find(separator);
    fields.push_back(trim(row.substr(0, end)));
    if (end == std::string_view::npos) return fields;
    row.remove_prefix(end + 1);
    if (separator == ' ') row = trim(row);
  }
}

Result<TableReader> TableReader::open(const std::string& path, TableFormat format) {
  auto lines = LineReader::open(path);
  if (!lines) return failure(lines);
  return begin(path, std::move(format), std::move(*lines));
}

Result<TableReader> TableReader::over(std::string text, const std::string& name, TableFormat format) {
  return begin(name, std::move(format), LineReader::over(std::move(text)));
}

Result<TableReader> TableReader::begin(std::string path, TableFormat format, LineReader lines) {
  TableReader table(std::move(path), std::move(format), std::move(lines));
  const std::string header = table.format_.header;
  if (header.empty()) return table;
  const auto first = table.next();
  if (!first) return failure(first);
  if (!*first)
    return failure(ErrorCode::input, fmt::format("the file is empty, expected the columns '{}'", header), table.path_);
  const std::vector<std::string_view> expected = split(header, table.format_.separator);
  for (const std::string_view name : expected) table.columns_.push_back(index_of(**first, name));
  table.has_all_columns_ = **first == expected;
  if (table.has_all_columns_) return table;
  const std::string& required = table.format_.required;
  const auto is_in = [](const std::vector<std::string_view>& names) {
    return [&names](std::string_view name) { return index_of(names, name).has_value(); };
  };
  const auto needed = split(required, table.format_.separator);
  const bool all_known = std::all_of((*first)->begin(), (*first)->end(), is_in(expected));
  if (!required.empty() && all_known && std::all_of(needed.begin(), needed.end(), is_in(**first))) return table;
  return table.error_in_row(fmt::format("the columns are {}, expected '{}'{}", quote(table.line_), header,
                                        required.empty() ? "" : " or some of them, at least '" + required + "'"));
}

Result<std::optional<std::vector<std::string_view>>> TableReader::next() {
  for (;;) {
    auto line = lines_.next();
    if (!line) return failure(line);
    if (!*line) return std::nullopt;
    line_ = (*line)->text;
    if (++line_number_ == 1 && line_.starts_with(kByteOrderMark)) line_.remove_prefix(kByteOrderMark.size());
    line_ = trim(line_);
    if ((*line)->is_too_long) return error_in_row("the line is too long");
    if (line_.empty() || line_.front() == '#') continue;
    if (!(*line)->has_newline && format_.ends_with_newline) return error_in_row("the file is truncated in this line");
    return split(line_, format_.separator);
  }
}

Result<std::optional<std::vector<std::string_view>>> TableReader::next(std::size_t fields) {
  auto row = next();
  if (row && *row && (*row)->size() < fields) {
    return error_in_row(fmt::format("{} values, expected {}: {}", (*row)->size(), fields, quote(line_)));
  }
  return row;
}

bool is_in_range(Stamp stamp) {
  return stamp.ns <= kLargestStamp && stamp.ns >= -kLargestStamp;
}

std::optional<Stamp> parse_stamp_ns(std::string_view text) {
  const auto ns = parse_number<std::int64_t>(text);
  if (!ns || !is_in_range(Stamp{*ns})) return std::nullopt;
  return Stamp{*ns};
}

// Not every double of radians has a double of degrees that converts back to it; long double has enough digits.
std::optional<double> parse_degrees(std::string_view text) {
  const auto degrees = parse_number<long double>(text);
  if (!degrees) return std::nullopt;
  return static_cast<double>(*degrees * (std::numbers::pi_v<long double> / 180));
}

std::string to_degrees(double radians) {
  const long double degrees = static_cast<long double>(radians) * (180 / std::numbers::pi_v<long double>);
  std::string text;
  // At least three digits: with fewer, 90 would be written as 9e+01.
  for (int digits = 3; digits <= 21; ++digits) {
    text = fmt::format("{:.{}g}", degrees, digits);
    if (parse_degrees(text) == radians) break;
  }
  return text;
}

}  // namespace spartan::internal
