// Poses as the recording's own truth gives them.
#pragma once

#include "spartan/core/pose.h"
#include "spartan/core/trajectory.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// A world_from_body pose in the recording's convention (Rig::convention): for `body` itself; for `left_optical`
/// B⁻¹ T B with B = body_from_camera of the first pair's left camera, so that a start at the identity stays there.
Pose in_recording_convention(const Rig& rig, const Pose& world_from_body);
Trajectory in_recording_convention(const Rig& rig, Trajectory world_from_body);

}  // namespace spartan
