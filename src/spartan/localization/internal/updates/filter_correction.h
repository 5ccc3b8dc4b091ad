// Corrections of the state that keep one of its two poses: that in the world, or that of the odometry.
#pragma once

#include "spartan/core/trajectory.h"
#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/internal/kalman_update.h"

namespace spartan::internal {

/// Measurements of the pose in the world: odom_from_body is preserved, world_from_odom takes the correction. Nothing
/// changes where the covariance of the innovation is not positive definite.
void correct_world(FilterMemory& memory, const Innovation& innovation);
/// The same by a match of maps. Errors of consecutive matches are correlated (the same rocks, seen from afar first), so
/// they must not update the drift states of vision (Schmidt).
void correct_by_map(FilterMemory& memory, const Innovation& innovation);

/// Measurements of the motion since a clone: odom_from_body becomes its value at the clone times the corrected motion.
void correct_motion(FilterMemory& memory, const Innovation& innovation, int clone);
/// The same since the step clone, of pose and velocity only: between two frames without an IMU, wheels say nothing
/// about errors that vision measures.
void correct_prediction(FilterMemory& memory, const Innovation& innovation);
void set_odom_by_motion(FilterMemory& memory, int clone);

/// odom_from_body of the IMU, with the covariance accumulated since the start.
UncertainPose odom_from_imu(const FilterMemory& memory);

}  // namespace spartan::internal
