#include "spartan/camera/internal/recording_index.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <map>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/internal/stamp_order.h"

namespace spartan::internal {
namespace {

namespace fs = std::filesystem;

void set_fault(FrameEntry& entry, FrameFault fault, std::string message) {
  if (entry.fault) return;
  entry.fault = fault;
  entry.message = std::move(message);
}

bool has_file(const std::string& path) {
  std::error_code error;
  return !path.empty() && fs::is_regular_file(path, error);
}

void check_image_files(FrameEntry& entry) {
  if (entry.fault) return;
  const bool left = has_file(entry.left_file), right = has_file(entry.right_file);
  if (left && right) return;
  const std::string& missing = left ? entry.right_file : entry.left_file;
  const std::string what = missing.empty()
                               ? fmt::format("frame {} lists no {} image", entry.frame_id, left ? "right" : "left")
                               : fmt::format("{}: is missing", missing);
  set_fault(entry, left ? FrameFault::right_missing : FrameFault::left_missing,
            what + (left || right ? "" : ", and so is the right image"));
}

// Marks the frames of one pair with reversed stamps and sets when each is played: at its own stamp, or, where that is
// reversed, at the stamp of the last frame before it in the list that is not.
void order_pair(std::vector<FrameEntry>& frames, const std::vector<std::size_t>& members, SequenceReport& report) {
  std::vector<std::size_t> listed;
  std::vector<Stamp> stamps;
  for (const std::size_t i : members) {
    frames[i].playback_stamp = frames[i].left_stamp;
    if (frames[i].right_only) continue;
    listed.push_back(i);
    stamps.push_back(frames[i].left_stamp);
  }
  const std::vector<bool> reversed = find_reversals(stamps);
  const auto first = std::find(reversed.begin(), reversed.end(), false);
  if (first == reversed.end()) return;
  Stamp last = stamps[static_cast<std::size_t>(first - reversed.begin())];
  for (std::size_t k = 0; k < listed.size(); ++k) {
    FrameEntry& entry = frames[listed[k]];
    if (!reversed[k]) {
      last = stamps[k];
      continue;
    }
    ++report.reversals;
    entry.playback_stamp = last;
    entry.fault = FrameFault::stamp_reversed;
    entry.message = fmt::format("{}: the stamp {} s is out of order; the last stamp in order is {} s",
                                entry.left_file.empty() ? fmt::format("frame {}", entry.frame_id) : entry.left_file,
                                to_decimal_seconds(stamps[k]), to_decimal_seconds(last));
  }
}

void report_pair(const std::vector<FrameEntry>& frames, const std::vector<std::size_t>& members,
                 SequenceReport& report) {
  std::vector<Stamp> complete;
  for (const std::size_t i : members) {
    if (!frames[i].fault) complete.push_back(frames[i].left_stamp);
  }
  std::sort(complete.begin(), complete.end());
  const StepReport steps = report_steps(complete);
  if (report.median_step_s == 0) report.median_step_s = steps.median_s;
  report.gaps += steps.gaps;
  report.longest_gap_s = std::max(report.longest_gap_s, steps.longest_gap_s);
}

Status require_usable_frame(const RecordingIndex& index) {
  if (std::any_of(index.frames.begin(), index.frames.end(), [](const FrameEntry& s) { return !s.fault; })) return {};
  if (index.frames.empty()) return failure(ErrorCode::input, "lists no stereo frame", index.info.path);
  return failure(ErrorCode::input,
                 fmt::format("none of the {} listed stereo frames is usable; the first one: {}", index.frames.size(),
                             index.frames.front().message),
                 index.info.path, "each frame needs both images and an increasing stamp");
}

}  // namespace

Status validate_and_sort(RecordingIndex& index, double pair_tolerance_s) {
  std::vector<FrameEntry>& frames = index.frames;
  SequenceReport& report = index.info.sequence;
  report.announced = static_cast<int>(frames.size());
  std::map<std::string, std::vector<std::size_t>> pairs;
  for (std::size_t i = 0; i < frames.size(); ++i) pairs[frames[i].pair].push_back(i);

  for (FrameEntry& entry : frames) check_image_files(entry);
  for (const auto& [name, members] : pairs) order_pair(frames, members, report);
  for (FrameEntry& entry : frames) {
    report.orphans_left += entry.fault == FrameFault::right_missing;
    report.orphans_right += entry.fault == FrameFault::left_missing && has_file(entry.right_file);
    const double apart = std::abs(seconds_between(entry.left_stamp, entry.right_stamp));
    if (apart > pair_tolerance_s) {
      set_fault(
          entry, FrameFault::stamps_apart,
          fmt::format("{}: the stamps of the left and right image differ by {:.6f} s, more than the tolerance of {} s",
                      entry.left_file, apart, pair_tolerance_s));
    }
  }
  for (const auto& [name, members] : pairs) {
    const StereoPair* pair = index.info.rig.find_pair(name);
    if (pair && (pair->for_odometry || pairs.size() == 1)) report_pair(frames, members, report);
  }

  std::stable_sort(frames.begin(), frames.end(),
                   [](const FrameEntry& a, const FrameEntry& b) { return a.playback_stamp < b.playback_stamp; });
  return require_usable_frame(index);
}

std::string default_pair(const Rig& rig) {
  for (const StereoPair& pair : rig.pairs) {
    if (pair.for_odometry) return pair.name;
  }
  return rig.pairs.empty() ? std::string() : rig.pairs.front().name;
}

Result<RigChoice> choose_rig(const OpenOptions& options, const std::string& own_file, ImageSize size_hint,
                             const std::function<Result<Rig>()>& read_own) {
  const bool own = options.rig_file.empty();
  std::error_code error;
  if (own && !fs::exists(own_file, error)) {
    return failure(ErrorCode::input, "is missing: the recording has no calibration", own_file,
                   "add the file, or give a calibration with --rig");
  }
  auto rig = own ? read_own() : read_rig(options.rig_file, size_hint);
  if (!rig) return failure(rig);
  return RigChoice{std::move(*rig), own ? own_file : options.rig_file};
}

}  // namespace spartan::internal
