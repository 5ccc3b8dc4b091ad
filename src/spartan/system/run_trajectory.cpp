#include <algorithm>

#include "spartan/system/run_folder.h"

namespace spartan {

std::string_view name_of(TrajectoryKind kind) {
  switch (kind) {
    case TrajectoryKind::odometry:
      return "odometry";
    case TrajectoryKind::slam:
      return "slam";
    case TrajectoryKind::localization:
      return "localization";
    case TrajectoryKind::smoothed:
      return "smoothed";
  }
  return "";
}

std::optional<TrajectoryKind> parse_trajectory_kind(std::string_view name) {
  for (const TrajectoryKind kind : kTrajectories) {
    if (name_of(kind) == name) return kind;
  }
  return std::nullopt;
}

std::optional<UncertainPose> pose_of(const FrameRecord& frame, TrajectoryKind kind) {
  if (kind == TrajectoryKind::localization) {
    return frame.localization ? std::optional(frame.localization->world_from_body) : std::nullopt;
  }
  if (kind == TrajectoryKind::smoothed) return frame.smoothed;
  if (!frame.has_pose) return std::nullopt;
  return kind == TrajectoryKind::slam ? frame.slam : std::optional(frame.world_from_body);
}

bool has_trajectory(const std::vector<FrameRecord>& frames, TrajectoryKind kind) {
  if (kind == TrajectoryKind::odometry) return true;
  return std::any_of(frames.begin(), frames.end(),
                     [kind](const FrameRecord& frame) { return pose_of(frame, kind).has_value(); });
}

Trajectory trajectory_of(const std::vector<FrameRecord>& frames, TrajectoryKind kind) {
  Trajectory trajectory;
  for (const FrameRecord& frame : frames) {
    if (const auto pose = pose_of(frame, kind)) trajectory.push_back({frame.stamp, pose->pose});
  }
  return trajectory;
}

Trajectory trajectory_without_gaps(const std::vector<FrameRecord>& frames, TrajectoryKind kind) {
  Trajectory trajectory;
  trajectory.reserve(frames.size());
  Pose from_odometry;  // world of this kind from world of the odometry, at the last pose
  for (const FrameRecord& frame : frames) {
    const Pose& predicted = frame.world_from_body.pose;
    const auto pose = pose_of(frame, kind);
    if (pose) from_odometry = pose->pose * predicted.inverse();
    trajectory.push_back({frame.stamp, pose ? pose->pose : from_odometry * predicted});
  }
  return trajectory;
}

}  // namespace spartan
