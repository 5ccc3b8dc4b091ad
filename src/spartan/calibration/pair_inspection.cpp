#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "spartan/calibration/internal/pair_refinement.h"
#include "spartan/calibration/internal/row_errors.h"
#include "spartan/calibration/pair_check.h"
#include "spartan/odometry/view_matching.h"

namespace spartan {

using namespace internal;

namespace {

// Of a row alignment; empirical.
constexpr int kMinAligned = 40;         // inliers
constexpr double kNeeded_px = 0.3;      // 95th percentile of the change of rows
constexpr double kMaxRemaining = 0.75;  // mean row error after over before
constexpr double kMaxRotation_rad = 2 * kRadiansPerDegree;

Status check_pair_of(const Rig& rig, const StereoPair& pair) {
  const StereoPair* const known = rig.find_pair(pair.name);
  if (known != nullptr && *known == pair) return {};
  return failure(ErrorCode::usage, "the rig has no pair '" + pair.name + "'", "inspection of a pair");
}

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

// 95th percentile of |before − after|.
double typical_change(const std::vector<double>& before, const std::vector<double>& after) {
  std::vector<double> changes;
  for (std::size_t i = 0; i < before.size(); ++i) changes.push_back(before[i] - after[i]);
  return row_errors(std::move(changes)).p95_px;
}

bool is_certain(const RowAlignment& found, const std::vector<PixelMatch>& inliers, ImageSize size) {
  const std::vector<double> any(inliers.size(), 0.0);
  return found.inliers >= kMinAligned && 4 * std::ssize(map_row_errors(inliers, any, size)) >= kRowErrorCells &&
         found.aligned.mean_px <= kGoodRowsMean_px && found.aligned.mean_px <= kMaxRemaining * found.given.mean_px &&
         std::hypot(found.pitch_rad, found.roll_rad) <= kMaxRotation_rad;
}

}  // namespace

bool PairInspection::sufficient() const {
  return std::isfinite(check.correction.pitch_rad);
}

Result<PairInspection> inspect_pair(const Rig& rig, const StereoPair& pair, std::span<const StereoViews> frames,
                                    const ThreadPool& workers, const InspectionProgress& progress) {
  if (Status known = check_pair_of(rig, pair); !known) return failure(known);
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

Result<RowAlignment> align_rows(const Rig& rig, const StereoPair& pair, std::span<const StereoViews> frames,
                                const ThreadPool& workers) {
  if (Status known = check_pair_of(rig, pair); !known) return failure(known);
  if (Status valid = check_frames(frames); !valid) return failure(valid);
  const std::vector<PixelMatch> matches = joined(match_frames(frames, workers, {}));
  RowAlignment result;
  result.matches = static_cast<int>(matches.size());
  if (result.matches < kMinAligned) return result;
  const Pose left_from_right = rig.right_from_left(pair).inverse();
  PairFitOptions options;
  options.yaw = options.focal = options.baseline = false;
  const PairFit fit = fit_pair(rig.find_camera(pair.left)->model, rig.find_camera(pair.right)->model, left_from_right,
                               matches, options);
  const std::vector<double> given = inliers_of(fit.given.row_error_px, fit.inlier),
                            aligned = inliers_of(fit.rows.row_error_px, fit.inlier);
  result.inliers = fit.inliers;
  result.pitch_rad = fit.correction.pitch_rad;
  result.roll_rad = fit.correction.roll_rad;
  result.given = row_errors(given);
  result.aligned = row_errors(aligned);
  if (!(typical_change(given, aligned) > kNeeded_px) ||
      !is_certain(result, inliers_of(matches, fit.inlier), frames.front().left.size()))
    return result;
  result.rig = rig;
  const auto right = std::find_if(result.rig->cameras.begin(), result.rig->cameras.end(),
                                  [&](const Camera& camera) { return camera.name == pair.right; });
  right->mount_from_camera =
      rig.find_camera(pair.left)->mount_from_camera * corrected_left_from_right(left_from_right, fit.correction);
  return result;
}

}  // namespace spartan
