#include "spartan/camera/recording_index.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <map>

#include "spartan/camera/stamp_order.h"
#include "spartan/rig/formats/rig_files.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;

void set_fault(Shot& shot, FrameFault fault, std::string message) {
  if (shot.fault) return;
  shot.fault = fault;
  shot.message = std::move(message);
}

bool has_file(const std::string& path) {
  std::error_code error;
  return !path.empty() && fs::is_regular_file(path, error);
}

void find_missing_files(Shot& shot) {
  if (shot.fault) return;
  const bool left = has_file(shot.left_file), right = has_file(shot.right_file);
  if (left && right) return;
  const std::string& missing = left ? shot.right_file : shot.left_file;
  const std::string what = missing.empty()
                               ? fmt::format("frame {} names no {} image", shot.frame_id, left ? "right" : "left")
                               : fmt::format("{}: is missing", missing);
  set_fault(shot, left ? FrameFault::right_missing : FrameFault::left_missing,
            what + (left || right ? "" : ", and so is the right image"));
}

// Marks what runs backwards among the shots of one pair and says when each is played: at its own stamp, or at that of
// the shot it is listed after where it runs backwards.
void order_pair(std::vector<Shot>& shots, const std::vector<std::size_t>& members, SequenceReport& report) {
  std::vector<std::size_t> listed;
  std::vector<Stamp> stamps;
  for (const std::size_t i : members) {
    shots[i].played_at = shots[i].left_stamp;
    if (shots[i].only_right) continue;
    listed.push_back(i);
    stamps.push_back(shots[i].left_stamp);
  }
  const std::vector<bool> reversed = find_reversals(stamps);
  const auto first = std::find(reversed.begin(), reversed.end(), false);
  if (first == reversed.end()) return;
  Stamp last = stamps[static_cast<std::size_t>(first - reversed.begin())];
  for (std::size_t k = 0; k < listed.size(); ++k) {
    Shot& shot = shots[listed[k]];
    if (!reversed[k]) {
      last = stamps[k];
      continue;
    }
    ++report.reversals;
    shot.played_at = last;
    shot.fault = FrameFault::stamp_reversed;
    shot.message = fmt::format("{}: the stamp {} s does not fit between its neighbours ({} s is the last good one)",
                               shot.left_file.empty() ? fmt::format("shot {}", shot.frame_id) : shot.left_file,
                               to_decimal_seconds(stamps[k]), to_decimal_seconds(last));
  }
}

void report_pair(const std::vector<Shot>& shots, const std::vector<std::size_t>& members, SequenceReport& report) {
  std::vector<Stamp> complete;
  for (const std::size_t i : members) {
    if (!shots[i].fault) complete.push_back(shots[i].left_stamp);
  }
  std::sort(complete.begin(), complete.end());
  const StepReport steps = report_steps(complete);
  if (report.median_step_s == 0) report.median_step_s = steps.median_s;
  report.gaps += steps.gaps;
  report.longest_gap_s = std::max(report.longest_gap_s, steps.longest_gap_s);
}

Status require_usable_shot(const RecordingIndex& index) {
  if (std::any_of(index.shots.begin(), index.shots.end(), [](const Shot& s) { return !s.fault; })) return {};
  if (index.shots.empty()) return failure(ErrorCode::input, "announces no stereo shot", index.info.path);
  return failure(ErrorCode::input,
                 fmt::format("none of the {} announced stereo shots is usable; the first one: {}", index.shots.size(),
                             index.shots.front().message),
                 index.info.path, "both images of a shot must be there, with stamps that increase");
}

}  // namespace

Status arrange(RecordingIndex& index, double pair_tolerance_s) {
  std::vector<Shot>& shots = index.shots;
  SequenceReport& report = index.info.sequence;
  report.announced = static_cast<int>(shots.size());
  std::map<std::string, std::vector<std::size_t>> pairs;
  for (std::size_t i = 0; i < shots.size(); ++i) pairs[shots[i].pair].push_back(i);

  for (Shot& shot : shots) find_missing_files(shot);
  for (const auto& [name, members] : pairs) order_pair(shots, members, report);
  for (Shot& shot : shots) {
    report.orphans_left += shot.fault == FrameFault::right_missing;
    report.orphans_right += shot.fault == FrameFault::left_missing && has_file(shot.right_file);
    const double apart = std::abs(seconds_between(shot.left_stamp, shot.right_stamp));
    if (apart > pair_tolerance_s) {
      set_fault(shot, FrameFault::stamps_apart,
                fmt::format("{}: its right image was taken {:.6f} s apart, more than the {} s allowed", shot.left_file,
                            apart, pair_tolerance_s));
    }
  }
  for (const auto& [name, members] : pairs) {
    const StereoPair* pair = index.info.rig.find_pair(name);
    if (pair && (pair->for_odometry || pairs.size() == 1)) report_pair(shots, members, report);
  }

  std::stable_sort(shots.begin(), shots.end(), [](const Shot& a, const Shot& b) { return a.played_at < b.played_at; });
  return require_usable_shot(index);
}

std::string only_pair(const Rig& rig) {
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
                   "add the file, or name a calibration with --rig");
  }
  auto rig = own ? read_own() : read_rig(options.rig_file, size_hint);
  if (!rig) return failure(rig);
  return RigChoice{std::move(*rig), own ? own_file : options.rig_file};
}

}  // namespace spartan
