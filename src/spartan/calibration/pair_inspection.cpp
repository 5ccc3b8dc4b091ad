#include "spartan/calibration/pair_inspection.h"

#include <cmath>
#include <utility>

#include "spartan/odometry/view_matching.h"

namespace spartan {
namespace {

Status check_frames(std::span<const StereoViews> frames) {
  if (frames.empty()) return failure(ErrorCode::usage, "there is no frame to match", "inspection of a pair");
  const ImageSize size = frames.front().left.size();
  for (const StereoViews& frame : frames) {
    if (size.empty() || frame.left.size() != size || frame.right.size() != size)
      return failure(ErrorCode::usage, "the images are empty or not all of one size", "inspection of a pair");
  }
  return {};
}

std::vector<std::vector<PixelMatch>> match_frames(std::span<const StereoViews> frames, const ThreadPool& workers,
                                                  const InspectionProgress& progress) {
  std::vector<std::vector<PixelMatch>> matches;
  for (const StereoViews& frame : frames) {
    std::vector<PixelMatch>& matched = matches.emplace_back();
    for (const ViewMatch& match : match_views(frame.left, frame.right, ViewMatchingOptions(), workers))
      matched.push_back({match.left, match.right});
    if (progress) progress(matches.size());
  }
  return matches;
}

std::vector<PixelMatch> joined(const std::vector<std::vector<PixelMatch>>& matches) {
  std::vector<PixelMatch> all;
  for (const std::vector<PixelMatch>& frame : matches) all.insert(all.end(), frame.begin(), frame.end());
  return all;
}

}  // namespace

bool PairInspection::sufficient() const {
  return std::isfinite(check.correction.pitch_rad);
}

Result<PairInspection> inspect_pair(const Rig& rig, const StereoPair& pair, std::span<const StereoViews> frames,
                                    const ThreadPool& workers, const InspectionProgress& progress) {
  const StereoPair* const known = rig.find_pair(pair.name);
  if (known == nullptr || *known != pair)
    return failure(ErrorCode::usage, "the rig has no pair '" + pair.name + "'", "inspection of a pair");
  if (Status valid = check_frames(frames); !valid) return failure(valid);
  PairInspection result;
  result.matches = match_frames(frames, workers, progress);
  result.check = check_pair(rig, pair, joined(result.matches), frames.front().left.size());
  return result;
}

Result<PairInspection> inspect_images(std::span<const StereoViews> frames, const ThreadPool& workers,
                                      const InspectionProgress& progress) {
  if (Status valid = check_frames(frames); !valid) return failure(valid);
  PairInspection result;
  result.matches = match_frames(frames, workers, progress);
  result.check = check_images(joined(result.matches), frames.front().left.size());
  return result;
}

}  // namespace spartan
