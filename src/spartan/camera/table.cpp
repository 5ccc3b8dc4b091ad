#include "spartan/camera/table.h"

#include <fmt/format.h>

#include <filesystem>
#include <limits>
#include <numbers>

namespace spartan {
namespace {

constexpr std::int64_t kLargestStamp = std::numeric_limits<std::int64_t>::max() / 2;
constexpr std::string_view kBlanks = " \t\r";

std::string_view trim(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

std::vector<std::string_view> split(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  for (;;) {
    const std::size_t end = separator == ' ' ? line.find_first_of(kBlanks) : line.find(separator);
    fields.push_back(trim(line.substr(0, end)));
    if (end == std::string_view::npos) return fields;
    line.remove_prefix(end + 1);
    if (separator == ' ') line = trim(line);
  }
}

// Held as text, a quotation of foreign bytes must stay short and printable.
std::string quote(std::string_view text) {
  std::string quoted;
  for (const char c : text.substr(0, 80)) quoted += c >= ' ' && c <= '~' ? c : '?';
  return "'" + quoted + (text.size() > 80 ? "…'" : "'");
}

}  // namespace

Result<TableReader> TableReader::open(const std::string& path, TableFormat format) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return failure(ErrorCode::input, "is missing, or no file", path);
  TableReader table(path, std::move(format));
  table.file_.open(path, std::ios::binary);
  if (!table.file_) return failure(ErrorCode::input, "cannot be read", path);
  if (table.format_.header.empty()) return table;
  std::getline(table.file_, table.line_);
  table.line_number_ = 1;
  if (trim(table.line_) != table.format_.header) {
    return failure(ErrorCode::input,
                   fmt::format("the columns are {}, expected are '{}'", quote(trim(table.line_)), table.format_.header),
                   table.place());
  }
  return table;
}

Result<std::optional<std::vector<std::string_view>>> TableReader::next() {
  while (std::getline(file_, line_)) {
    ++line_number_;
    const bool broken_off = file_.eof();
    const std::string_view line = trim(line_);
    if (line.empty() || (format_.header.empty() && line.front() == '#')) continue;
    if (broken_off && format_.ends_with_newline) return fault("the file breaks off in this line");
    return split(line, format_.separator);
  }
  if (file_.bad()) return failure(ErrorCode::input, "cannot be read to its end", path_);
  return std::nullopt;
}

Result<std::optional<std::vector<std::string_view>>> TableReader::next(std::size_t fields) {
  auto row = next();
  if (row && *row && (*row)->size() < fields) {
    return fault(fmt::format("{} values where {} are expected: {}", (*row)->size(), fields, quote(trim(line_))));
  }
  return row;
}

bool is_sane(Stamp stamp) {
  return stamp.ns <= kLargestStamp && stamp.ns >= -kLargestStamp;
}

std::optional<Stamp> parse_stamp_ns(std::string_view text) {
  const auto ns = parse_number<std::int64_t>(text);
  if (!ns || !is_sane(Stamp{*ns})) return std::nullopt;
  return Stamp{*ns};
}

// A double of degrees cannot name every double of radians; a few digits more can.
std::optional<double> parse_degrees(std::string_view text) {
  const auto degrees = parse_number<long double>(text);
  if (!degrees) return std::nullopt;
  return static_cast<double>(*degrees * (std::numbers::pi_v<long double> / 180));
}

std::string to_degrees(double radians) {
  const long double degrees = static_cast<long double>(radians) * (180 / std::numbers::pi_v<long double>);
  std::string text;
  // From three digits on: fewer would write 90 as 9e+01.
  for (int digits = 3; digits <= 21; ++digits) {
    text = fmt::format("{:.{}g}", degrees, digits);
    if (parse_degrees(text) == radians) break;
  }
  return text;
}

}  // namespace spartan
