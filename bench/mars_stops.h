// Recorded stops of simulated drives with their truth.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "spartan/camera/frame_source.h"
#include "spartan/core/files.h"
#include "spartan/core/geotiff.h"
#include "spartan/core/trajectory.h"
#include "spartan/imaging/imager.h"
#include "spartan/reconstruction/position_mapper.h"

namespace spartan {

// A recording with its truth.
struct Drive {
  std::string folder;
  std::unique_ptr<FrameSource> source;
  Rig rig;
  Trajectory poses;
  LoadedMap elevation, obstacles;
  std::map<std::int64_t, std::vector<ShotName>> stops;  // where more than one pair looked
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
  // Shots are numbered by position without gaps, and every position has one of the odometry's pair.
  for (std::int64_t position = 0;; ++position) {
    std::vector<ShotName> shots = drive.source->shots_at(position);
    if (shots.empty()) break;
    if (shots.size() > 1) drive.stops[position] = std::move(shots);
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

// The views of one stop, taken by the mapper.
inline void look(Drive& drive, Imager& imager, PositionMapper& mapper, const std::vector<ShotName>& shots) {
  mapper.leave();
  for (const auto& [pair, stamp] : shots) {
    const auto frame = drive.source->frame_at(pair, stamp);
    if (!frame) continue;
    const auto shot = imager.process(*frame);
    if (shot) (void)mapper.add(*shot, drive.rig.find_pair(pair)->nearest_m);
  }
}

}  // namespace spartan
