// Poses as the recording's own truth gives them.
#pragma once

#include "spartan/core/pose.h"
#include "spartan/core/trajectory.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// A trajectory of world_from_body in the recording's convention (Rig::convention): for `body` itself; for
/// `left_optical` first_left_from_left, the left camera of the first pair seen from where it stood at the first entry,
/// (T₀ B)⁻¹ Tᵢ B with B = body_from_left, whichever way the world's axes lie.
Trajectory in_recording_convention(const Rig& rig, Trajectory world_from_body);

/// first_left_from_left of the named pair, as KITTI's pose files have it.
Trajectory in_left_optical_convention(const Rig& rig, const StereoPair& pair, Trajectory world_from_body);

}  // namespace spartan
