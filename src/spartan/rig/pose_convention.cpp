#include "spartan/rig/pose_convention.h"

namespace spartan {

Pose in_recording_convention(const Rig& rig, const Pose& world_from_body) {
  if (rig.convention == PoseConvention::body || rig.pairs.empty()) return world_from_body;
  const Pose body_from_left = rig.body_from_camera(rig.pairs.front().left);
  return body_from_left.inverse() * world_from_body * body_from_left;
}

Trajectory in_recording_convention(const Rig& rig, Trajectory world_from_body) {
  for (StampedPose& entry : world_from_body) entry.pose = in_recording_convention(rig, entry.pose);
  return world_from_body;
}

}  // namespace spartan
