// The three trajectories of a run.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "spartan/core/trajectory.h"
#include "spartan/system/run_store.h"

namespace spartan {

/// Odometry: vision alone. SLAM: odometry corrected by map matching. Localization: all sensors.
enum class TrajectoryKind { odometry, slam, localization };
inline constexpr std::array kTrajectoriesBestFirst{TrajectoryKind::localization, TrajectoryKind::slam,
                                                   TrajectoryKind::odometry};

/// "odometry", "slam" or "localization", as in file names and on the command line.
std::string_view name_of(TrajectoryKind kind);
std::optional<TrajectoryKind> parse_trajectory_kind(std::string_view name);

/// world_from_body of the frame; none where it was not measured. The localization has poses while vision is lost.
std::optional<UncertainPose> pose_of(const FrameRecord& frame, TrajectoryKind kind);

/// Whether a run has this trajectory; a run by odometry alone has no other.
bool has_trajectory(const std::vector<FrameRecord>& frames, TrajectoryKind kind);

/// All measured poses, in time order.
Trajectory trajectory_of(const std::vector<FrameRecord>& frames, TrajectoryKind kind);

/// One pose for every frame: missing poses are extrapolated from the last pose with the odometry's prediction.
Trajectory trajectory_without_gaps(const std::vector<FrameRecord>& frames, TrajectoryKind kind);

}  // namespace spartan
