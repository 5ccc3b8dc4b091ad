// The three trajectories of a run.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "spartan/core/trajectory.h"
#include "spartan/system/run_store.h"

namespace spartan {

/// By vision alone; that with the latest correction by the map; by all the sensors there are.
enum class TrajectoryKind { odometry, slam, localization };
inline constexpr std::array kTrajectoriesBestFirst{TrajectoryKind::localization, TrajectoryKind::slam,
                                                   TrajectoryKind::odometry};

/// "odometry" …, as files and options say it.
std::string_view name_of(TrajectoryKind kind);
std::optional<TrajectoryKind> parse_trajectory_kind(std::string_view name);

/// world_from_body where it was measured; the localization goes on where vision is lost.
std::optional<UncertainPose> pose_of(const FrameRecord& frame, TrajectoryKind kind);

/// Whether a run has that trajectory: one by odometry alone has no other.
bool has_trajectory(const std::vector<FrameRecord>& frames, TrajectoryKind kind);

/// All of them, in the order of time.
Trajectory trajectory_of(const std::vector<FrameRecord>& frames, TrajectoryKind kind);

/// One pose for every frame: where there is none, the last one is carried on as the odometry predicts.
Trajectory trajectory_without_gaps(const std::vector<FrameRecord>& frames, TrajectoryKind kind);

}  // namespace spartan
