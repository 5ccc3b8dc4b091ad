#include "spartan/camera/internal/frame_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include "spartan/camera/internal/layouts/spartan_format.h"

namespace spartan::internal {
namespace {

using Row = std::vector<std::string_view>;

constexpr std::size_t kFrameIdColumn = 0, kRightStampColumn = 4;  // of frames.csv

// Calls `take` with every row; adds file and line to its errors.
template <class Take>
Status for_each_row(TableReader& table, std::size_t fields, Take take) {
  for (;;) {
    const auto row = table.next(fields);
    if (!row) return failure(row);
    if (!*row) return {};
    if (Status status = take(**row); !status) return table.error_in_row(status.error().what);
  }
}

tl::unexpected<Error> input_error(std::string what) {
  return failure(ErrorCode::input, std::move(what));
}

// Whether `text` starts with the pattern `form`, in which 0 stands for any digit.
bool has_form(std::string_view text, std::string_view form) {
  if (text.size() < form.size()) return false;
  for (std::size_t i = 0; i < form.size(); ++i) {
    const bool digit = text[i] >= '0' && text[i] <= '9';
    if (form[i] == '0' ? !digit : text[i] != form[i]) return false;
  }
  return true;
}

// "2011-09-26 13:02:25.964389445" → nanoseconds since 1970.
std::optional<Stamp> parse_date(std::string_view date, std::string_view time) {
  namespace chrono = std::chrono;
  if (date.size() != 10 || !has_form(date, "0000-00-00") || !has_form(time, "00:00:00")) return std::nullopt;
  const auto number = [](std::string_view text) { return parse_number<int>(text).value_or(0); };
  const chrono::year_month_day day{chrono::year(number(date.substr(0, 4))),
                                   chrono::month(static_cast<unsigned>(number(date.substr(5, 2)))),
                                   chrono::day(static_cast<unsigned>(number(date.substr(8, 2))))};
  const int hour = number(time.substr(0, 2)), minute = number(time.substr(3, 2));
  const auto second = parse_decimal_seconds(time.substr(6));
  if (!day.ok() || hour > 23 || minute > 59 || !second || second->seconds() > 61) return std::nullopt;
  // 64 bits of nanoseconds hold ±292 years around 1970.
  if (day.year() < chrono::year(1900) || day.year() > chrono::year(2100)) return std::nullopt;
  const chrono::nanoseconds whole =
      chrono::sys_days(day).time_since_epoch() + chrono::hours(hour) + chrono::minutes(minute);
  return Stamp{whole.count() + second->ns};
}

// Whether a file name of a table stays inside the folder that it is relative to.
bool stays_inside(std::string_view name) {
  const std::filesystem::path path(name);
  return path.is_relative() && std::find(path.begin(), path.end(), "..") == path.end();
}

// Parses one row of frames.csv, complete; errors name the column.
Result<FrameEntry> read_spartan_frame(const std::filesystem::path& folder, const Rig& rig, const Row& row) {
  const auto wrong = [](const char* column, std::string_view text) {
    return input_error(fmt::format("{} is '{}'", column, text.substr(0, 40)));
  };
  const auto frame_id = parse_number<std::int64_t>(row[0]), position_id = parse_number<std::int64_t>(row[1]);
  const auto left = parse_stamp_ns(row[3]), right = parse_stamp_ns(row[4]);
  const auto pan = parse_degrees(row[7]), tilt = parse_degrees(row[8]);
  const auto exposure = parse_number<double>(row[9]), gain = parse_number<double>(row[10]);
  const auto bits = parse_number<int>(row[11]);
  if (!frame_id) return wrong("frame_id", row[0]);
  if (!position_id) return wrong("position_id", row[1]);
  if (!rig.find_pair(std::string(row[2]))) return wrong("pair (not in the rig)", row[2]);
  if (!left) return wrong("left_stamp_ns", row[3]);
  if (!right) return wrong("right_stamp_ns", row[4]);
  if (!pan) return wrong("pan_deg", row[7]);
  if (!tilt) return wrong("tilt_deg", row[8]);
  if (!exposure) return wrong("exposure_us", row[9]);
  if (!gain) return wrong("gain", row[10]);
  if (!bits || (*bits != 0 && (*bits < 8 || *bits > 16))) return wrong("bits", row[11]);
  if (!stays_inside(row[5])) return wrong("left (outside of the recording)", row[5]);
  if (!stays_inside(row[6])) return wrong("right (outside of the recording)", row[6]);
  FrameEntry entry;
  entry.frame_id = *frame_id;
  entry.position_id = *position_id;
  entry.pair = std::string(row[2]);
  entry.left_stamp = *left;
  entry.right_stamp = *right;
  const auto file = [&](std::string_view name) { return name.empty() ? "" : (folder / std::string(name)).string(); };
  entry.left_file = file(row[5]);
  entry.right_file = file(row[6]);
  entry.pan_rad = *pan;
  entry.tilt_rad = *tilt;
  entry.exposure_us = *exposure;
  entry.gain = *gain;
  entry.bits = *bits;
  return entry;
}

}  // namespace

Result<std::vector<Stamp>> read_kitti_times(TableReader table) {
  std::vector<Stamp> stamps;
  const Status status = for_each_row(table, 1, [&](const Row& row) -> Status {
    const auto stamp = parse_decimal_seconds(row[0]);
    if (!stamp) return failure(stamp);
    if (!is_in_range(*stamp)) return input_error("the time is out of range");
    stamps.push_back(*stamp);
    return {};
  });
  if (!status) return failure(status);
  return stamps;
}

Result<std::vector<Stamp>> read_kitti_raw_times(TableReader table) {
  std::vector<Stamp> stamps;
  const Status status = for_each_row(table, 2, [&](const Row& row) -> Status {
    const auto stamp = parse_date(row[0], row[1]);
    if (!stamp) return input_error("expected a date and a time of day");
    stamps.push_back(*stamp);
    return {};
  });
  if (!status) return failure(status);
  return stamps;
}

Result<EurocImages> read_euroc_images(TableReader table) {
  EurocImages images;
  const Status status = for_each_row(table, 2, [&](const Row& row) -> Status {
    const auto stamp = parse_stamp_ns(row[0]);
    if (!stamp) return input_error("the first column is not a time in nanoseconds");
    if (row[1].empty()) return input_error("the file name is empty");
    if (!stays_inside(row[1])) return input_error("the file name leads out of the recording");
    images.stamps.push_back(*stamp);
    images.files.emplace_back(row[1]);
    return {};
  });
  if (!status) return failure(status);
  return images;
}

Result<std::vector<FrameEntry>> read_spartan_frames(TableReader table, const std::string& folder, const Rig& rig,
                                                    bool unfinished) {
  std::vector<FrameEntry> frames;
  const std::vector<std::optional<std::size_t>> columns = table.columns();
  const std::string pair = default_pair(rig);
  // Columns that the file does not have, in the order of the header; frame_id counts, the right stamp is the left one.
  const std::array<std::string_view, 12> defaults{"", "-1", pair, "", "", "", "", "0", "0", "0", "0", "0"};
  std::size_t fields = 0;
  for (const auto& column : columns) fields = std::max(fields, column ? *column + 1 : 0);
  const Status status = for_each_row(table, fields, [&](const Row& given) -> Status {
    const std::string number = std::to_string(frames.size());
    Row row;
    for (std::size_t i = 0; i < columns.size(); ++i) row.push_back(columns[i] ? given[*columns[i]] : defaults[i]);
    if (!columns[kFrameIdColumn]) row[kFrameIdColumn] = number;
    if (!columns[kRightStampColumn]) row[kRightStampColumn] = row[kRightStampColumn - 1];
    auto entry = read_spartan_frame(folder, rig, row);
    if (!entry) return failure(entry);
    frames.push_back(std::move(*entry));
    return {};
  });
  if (!status && !(unfinished && status.error().code == ErrorCode::input)) return failure(status);
  return frames;
}

TableFormat spartan_frames_format() {
  return {.separator = ',', .header = kFramesHeader, .required = kLeastFramesHeader, .ends_with_newline = true};
}

}  // namespace spartan::internal
