#include "spartan/camera/internal/layouts/time_list.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "spartan/camera/internal/layouts/name_numbers.h"
#include "spartan/camera/internal/table.h"
#include "spartan/core/files.h"

namespace spartan::internal {
namespace {

struct TextRow {
  std::string time, location;
  std::vector<std::string> names;
};

Result<std::vector<TextRow>> read_rows(const std::string& path) {
  auto text = read_file(path);
  if (!text) return failure(text);
  std::replace_if(
      text->begin(), text->end(), [](char c) { return c == ',' || c == ';'; }, ' ');
  auto table = TableReader::over(std::move(*text), path, {.separator = ' ', .header = {}, .ends_with_newline = false});
  if (!table) return failure(table);
  std::vector<TextRow> rows;
  for (bool first = true;; first = false) {
    const auto fields = table->next();
    if (!fields) return failure(fields);
    if (!*fields) return rows;
    TextRow row;
    row.location = table->location();
    for (const std::string_view field : **fields) {
      if (!parse_number<double>(field)) {
        row.names.emplace_back(field);
      } else if (row.time.empty()) {
        row.time = field;
      }
    }
    if (!row.time.empty()) {
      rows.push_back(std::move(row));
    } else if (!first) {
      return table->error_in_row("holds no time");
    }
  }
}

}  // namespace

Result<TimeList> read_time_list(const std::string& path) {
  const auto rows = read_rows(path);
  if (!rows) return failure(rows);
  std::vector<std::int64_t> integers;
  for (const TextRow& row : *rows) {
    const auto value = parse_number<std::int64_t>(row.time);
    if (!value) break;
    integers.push_back(*value);
  }
  const bool are_integers = integers.size() == rows->size();
  const StampUnit unit = are_integers ? stamp_unit(integers).value_or(StampUnit::seconds) : StampUnit::seconds;
  TimeList list;
  list.unit = name_of(unit);
  for (std::size_t i = 0; i < rows->size(); ++i) {
    const TextRow& row = (*rows)[i];
    const auto decimal = are_integers ? Result<Stamp>() : parse_decimal_seconds(row.time);
    const auto stamp = are_integers ? to_stamp(integers[i], unit) : decimal ? std::optional(*decimal) : std::nullopt;
    if (!stamp || !is_in_range(*stamp)) return failure(ErrorCode::input, "the time is out of range", row.location);
    list.rows.push_back({*stamp, row.names});
  }
  return list;
}

}  // namespace spartan::internal
