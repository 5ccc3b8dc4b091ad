// A trajectory: poses over time.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/time.h"

namespace spartan {

struct StampedPose {
  Stamp stamp;
  Pose pose;  ///< world_from_body
};

/// In order of time.
using Trajectory = std::vector<StampedPose>;

enum class TrajectoryFormat { tum, kitti, euroc };

/// One line a pose: "seconds tx ty tz qx qy qz qw", seconds with nanosecond digits.
std::string to_tum(const Trajectory& trajectory);
/// One line a pose: the 12 numbers of the upper 3×4 matrix, row by row.
std::string to_kitti(const Trajectory& trajectory);
/// "timestamp [ns],px,py,pz,qw,qx,qy,qz".
std::string to_euroc(const Trajectory& trajectory);

/// Readers give code `input` with "file:line" for what they cannot understand: wrong count of numbers, NaN,
/// quaternions without length, matrices that are no rotations, stamps that do not increase.
Result<Trajectory> parse_tum(const std::string& text, const std::string& name);
/// `stamps` as many as there are lines, or empty: then 0, 1, 2 … s.
Result<Trajectory> parse_kitti(const std::string& text, const std::string& name, const std::vector<Stamp>& stamps);
Result<Trajectory> parse_euroc(const std::string& text, const std::string& name);

struct LoadedTrajectory {
  Trajectory poses;
  TrajectoryFormat format = TrajectoryFormat::tum;
  bool has_stamps = true;    ///< false: a KITTI file without `times.txt` beside it; stamps are line numbers
  bool has_rotation = true;  ///< false: all rotations are the identity, so the file knows positions only
};

/// Guesses the format from the content (12 numbers a line: KITTI, with stamps from `times.txt` beside it;
/// commas: EuRoC; 8 numbers: TUM).
Result<LoadedTrajectory> load_trajectory(const std::string& path);

/// Length of the polyline through the positions, in metres.
double path_length(const Trajectory& trajectory);

}  // namespace spartan
