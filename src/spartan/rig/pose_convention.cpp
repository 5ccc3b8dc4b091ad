#include <utility>

#include "spartan/rig/rig.h"

namespace spartan {

Trajectory in_recording_convention(const Rig& rig, Trajectory world_from_body) {
  if (rig.convention == PoseConvention::body || rig.pairs.empty()) return world_from_body;
  return in_left_optical_convention(rig, rig.pairs.front(), std::move(world_from_body));
}

Trajectory in_left_optical_convention(const Rig& rig, const StereoPair& pair, Trajectory world_from_body) {
  if (world_from_body.empty()) return world_from_body;
  const Pose body_from_left = rig.body_from_camera(pair.left);
  const Pose first_left_from_world = (world_from_body.front().pose * body_from_left).inverse();
  for (StampedPose& entry : world_from_body) entry.pose = first_left_from_world * entry.pose * body_from_left;
  return world_from_body;
}

}  // namespace spartan
