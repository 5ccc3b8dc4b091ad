// Stops of simulated recordings with their ground truth.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/core/files.h"
#include "spartan/core/trajectory.h"
#include "spartan/imaging/imager.h"
#include "spartan/reconstruction/stop_mapper.h"
#include "spartan/storage/geotiff.h"

namespace spartan {

// A recording with its ground truth.
struct Drive {
  std::string folder;
  std::unique_ptr<Recording> source;
  Rig rig;
  Trajectory poses;
  LoadedMap elevation, obstacles;
  std::map<std::int64_t, std::vector<FrameKey>> stops;  // with frames of more than one pair
};

inline Result<Drive> open_drive(const std::string& folder) {
  Drive drive;
  drive.folder = folder;
  auto source = open_recording(folder);
  const auto poses = read_file(folder + "/truth/poses.tum");
  auto elevation = read_geotiff(folder + "/truth/elevation.tif"),
       obstacles = read_geotiff(folder + "/truth/obstacles.tif");
  if (!source) return failure(source);
  if (!poses) return failure(poses);
  if (!elevation) return failure(elevation);
  if (!obstacles) return failure(obstacles);
  auto trajectory = parse_tum(*poses, "truth");
  if (!trajectory) return failure(trajectory);
  drive.source = std::move(*source);
  drive.rig = drive.source->info().rig;
  drive.poses = std::move(*trajectory);
  drive.elevation = std::move(*elevation);
  drive.obstacles = std::move(*obstacles);
  // Position ids have no gaps, and every position has a frame of the odometry pair.
  for (std::int64_t position = 0;; ++position) {
    std::vector<FrameKey> frames = drive.source->frames_at(position);
    if (frames.empty()) break;
    if (frames.size() > 1) drive.stops[position] = std::move(frames);
  }
  return drive;
}

inline Pose true_pose(const Drive& drive, Stamp stamp) {
  return std::min_element(drive.poses.begin(), drive.poses.end(),
                          [&](const StampedPose& a, const StampedPose& b) {
                            return std::abs(a.stamp.ns - stamp.ns) < std::abs(b.stamp.ns - stamp.ns);
                          })
      ->pose;
}

// Adds all views of one stop to the mapper.
inline void add_views(Drive& drive, Imager& imager, StopMapper& mapper, const std::vector<FrameKey>& frames) {
  mapper.leave();
  for (const auto& [pair, stamp] : frames) {
    const auto frame = drive.source->frame_at(pair, stamp);
    if (!frame) continue;
    const auto rectified = imager.process(*frame);
    if (rectified) (void)mapper.add(*rectified, drive.rig.find_pair(pair)->nearest_m);
  }
}

}  // namespace spartan
