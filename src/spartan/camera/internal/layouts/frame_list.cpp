#include "spartan/camera/internal/layouts/frame_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "spartan/camera/internal/layouts/name_numbers.h"
#include "spartan/camera/internal/layouts/time_list.h"
#include "spartan/camera/internal/stamp_order.h"

namespace spartan::internal {
namespace {

namespace fs = std::filesystem;

constexpr double kAssumedRate_hz = 10;
constexpr std::int64_t kLargestFrameNumber =
    100'000'000;  // of a frame; larger ones (dates, counters) only order the images

struct Images {
  std::vector<std::string> stems, paths;
  std::optional<NameNumbers> numbers;
};

Images images_of(const std::map<std::string, std::string>& files) {
  Images images;
  for (const auto& [stem, path] : files) {
    images.stems.push_back(stem);
    images.paths.push_back(path);
  }
  images.numbers = numbers_in_names(images.stems);
  return images;
}

// A frame of a left and a right image; `stamp` where names state it.
struct Paired {
  std::string left, right;
  std::int64_t number = 0;
  std::optional<Stamp> left_stamp, right_stamp;
};

std::optional<std::vector<Stamp>> stamps_of(const NameNumbers& numbers, std::optional<StampUnit> unit) {
  std::vector<Stamp> stamps;
  for (const std::int64_t value : numbers.values) {
    const auto stamp = numbers.decimal_seconds ? std::optional(Stamp{value}) : to_stamp(value, *unit);
    if (!stamp) return std::nullopt;
    stamps.push_back(*stamp);
  }
  return stamps;
}

std::vector<Paired> pair_by_stamp(const Images& left, const Images& right, const std::vector<Stamp>& left_stamps,
                                  const std::vector<Stamp>& right_stamps, double tolerance_s) {
  std::vector<Paired> frames;
  for (const StampMatch& match : match_stamps(left_stamps, right_stamps, tolerance_s)) {
    Paired frame;
    frame.number = static_cast<std::int64_t>(frames.size());
    if (match.left) {
      frame.left = left.paths[*match.left];
      frame.left_stamp = left_stamps[*match.left];
    }
    if (match.right) {
      frame.right = right.paths[*match.right];
      frame.right_stamp = right_stamps[*match.right];
    }
    frames.push_back(std::move(frame));
  }
  return frames;
}

std::vector<Paired> pair_by_number(const Images& left, const Images& right) {
  std::map<std::int64_t, Paired> frames;
  for (std::size_t i = 0; i < left.paths.size(); ++i) frames[left.numbers->values[i]].left = left.paths[i];
  for (std::size_t i = 0; i < right.paths.size(); ++i) frames[right.numbers->values[i]].right = right.paths[i];
  std::vector<Paired> list;
  const bool are_frame_numbers = frames.empty() || frames.rbegin()->first <= kLargestFrameNumber;
  for (auto& [number, frame] : frames) {
    frame.number = are_frame_numbers ? number : static_cast<std::int64_t>(list.size());
    list.push_back(std::move(frame));
  }
  return list;
}

Result<std::vector<Paired>> pair_by_rank(const Images& left, const Images& right) {
  if (left.paths.size() != right.paths.size()) {
    return failure(ErrorCode::input,
                   fmt::format("the names of the images hold no frame numbers, and there are {} left and {} right ones",
                               left.paths.size(), right.paths.size()),
                   fs::path(left.paths.front()).parent_path().string(),
                   "number the images, so that a missing one can be found");
  }
  std::vector<Paired> frames;
  for (std::size_t i = 0; i < left.paths.size(); ++i)
    frames.push_back({left.paths[i], right.paths[i], static_cast<std::int64_t>(i), {}, {}});
  return frames;
}

// The stamps of a list of times. Where it names images, frames that it does not name have none and are dropped.
Status apply_times(std::vector<Paired>& frames, const std::string& file, FrameList& result) {
  const auto list = read_time_list(file);
  if (!list) return failure(list);
  result.times = fmt::format("times in {} from {}", list->unit, fs::path(file).filename().string());
  const bool named =
      std::any_of(list->rows.begin(), list->rows.end(), [](const TimeRow& r) { return !r.names.empty(); });
  if (!named) {
    if (list->rows.size() < frames.size()) {
      return failure(ErrorCode::input, fmt::format("lists {} times for {} frames", list->rows.size(), frames.size()),
                     file);
    }
    for (std::size_t i = 0; i < frames.size(); ++i) frames[i].left_stamp = list->rows[i].stamp;
    return {};
  }
  std::map<std::string, Stamp> stamps;
  for (const TimeRow& row : list->rows) {
    for (const std::string& name : row.names) stamps.emplace(fs::path(name).stem().string(), row.stamp);
  }
  for (Paired& frame : frames) {
    for (const std::string& path : {frame.left, frame.right}) {
      const auto found = stamps.find(fs::path(path).stem().string());
      if (!path.empty() && found != stamps.end() && !frame.left_stamp) frame.left_stamp = found->second;
    }
  }
  const auto end = std::remove_if(frames.begin(), frames.end(), [](const Paired& f) { return !f.left_stamp; });
  if (end != frames.end())
    result.warnings.push_back(fmt::format("{} frames are not in {} and are not read", frames.end() - end, file));
  frames.erase(end, frames.end());
  if (frames.empty()) return failure(ErrorCode::input, "names none of the images", file);
  return {};
}

void apply_rate(std::vector<Paired>& frames, double rate_hz) {
  for (Paired& frame : frames)
    frame.left_stamp = Stamp{std::llround(1e9 * static_cast<double>(frame.number) / rate_hz)};
}

FrameEntry entry_of(const Paired& frame, const std::string& pair) {
  FrameEntry entry;
  entry.frame_id = frame.number;
  entry.pair = pair;
  entry.left_stamp = frame.left_stamp ? *frame.left_stamp : frame.right_stamp.value_or(Stamp());
  entry.right_stamp = frame.right_stamp.value_or(entry.left_stamp);
  entry.left_file = frame.left;
  entry.right_file = frame.right;
  entry.right_only = frame.left.empty() && frame.right_stamp.has_value();
  if (frame.left.empty() || frame.right.empty()) {
    entry.fault = frame.left.empty() ? FrameFault::left_missing : FrameFault::right_missing;
    entry.message = fmt::format("{}: has no image of the {} camera", frame.left.empty() ? frame.right : frame.left,
                                frame.left.empty() ? "left" : "right");
  }
  return entry;
}

}  // namespace

Result<FrameList> list_frames(const std::map<std::string, std::string>& left_files,
                              const std::map<std::string, std::string>& right_files, const std::string& pair,
                              const std::string& times_file, const OpenOptions& options) {
  const Images left = images_of(left_files), right = images_of(right_files);
  FrameList result;
  std::vector<Paired> frames;
  std::string unit;
  if (left.numbers && right.numbers) {
    const bool decimal = left.numbers->decimal_seconds && right.numbers->decimal_seconds;
    const auto of_left = stamp_unit(left.numbers->values);
    const bool integers = !left.numbers->decimal_seconds && !right.numbers->decimal_seconds;
    const auto left_stamps = decimal || (integers && of_left) ? stamps_of(*left.numbers, of_left) : std::nullopt;
    const auto right_stamps = left_stamps ? stamps_of(*right.numbers, of_left) : std::nullopt;
    if (right_stamps) {
      frames = pair_by_stamp(left, right, *left_stamps, *right_stamps, options.pair_tolerance_s);
      unit = decimal ? "seconds" : std::string(name_of(*of_left));
    } else {
      frames = pair_by_number(left, right);
    }
  } else {
    auto paired = pair_by_rank(left, right);
    if (!paired) return failure(paired);
    frames = std::move(*paired);
  }

  const std::string& times = options.times_file.empty() ? times_file : options.times_file;
  if (options.fps > 0 || !times.empty()) {
    for (Paired& frame : frames) frame.left_stamp = frame.right_stamp = std::nullopt;
  }
  if (options.fps > 0) {
    apply_rate(frames, options.fps);
    result.times = fmt::format("{} frames per second", options.fps);
  } else if (!times.empty()) {
    if (Status status = apply_times(frames, times, result); !status) return failure(status);
  } else if (!unit.empty()) {
    result.times = fmt::format("time stamps in {} from the file names", unit);
  } else {
    apply_rate(frames, kAssumedRate_hz);
    result.times = fmt::format("no times.txt: frames are assumed to be {} s apart", 1 / kAssumedRate_hz);
    result.warnings.push_back(fmt::format(
        "no time stamps: frames are assumed to be {} s apart; state their rate with --fps or their times with --times",
        1 / kAssumedRate_hz));
  }
  for (const Paired& frame : frames) result.frames.push_back(entry_of(frame, pair));
  return result;
}

}  // namespace spartan::internal
