// Conversion of trajectories to the pose convention of a recording's ground truth.
#pragma once

#include "spartan/core/pose.h"
#include "spartan/core/trajectory.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// Converts world_from_body to the recording's convention (Rig::convention). `body`: unchanged. `left_optical`:
/// first_left_from_left, the left camera of the first pair relative to its pose at the first entry,
/// (T₀ B)⁻¹ Tᵢ B with B = body_from_left; independent of the world frame.
Trajectory in_recording_convention(const Rig& rig, Trajectory world_from_body);

/// Converts world_from_body to first_left_from_left of a pair, the convention of KITTI's pose files.
Trajectory in_left_optical_convention(const Rig& rig, const StereoPair& pair, Trajectory world_from_body);

}  // namespace spartan
