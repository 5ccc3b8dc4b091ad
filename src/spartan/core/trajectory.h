// Trajectories and their file formats: TUM, KITTI, EuRoC.
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

/// Poses with strictly increasing stamps.
using Trajectory = std::vector<StampedPose>;

enum class TrajectoryFormat { tum, kitti, euroc };

/// One line per pose: "seconds tx ty tz qx qy qz qw", seconds with nine decimals.
std::string to_tum(const Trajectory& trajectory);
/// One line per pose: the upper 3×4 part of the matrix in row-major order.
std::string to_kitti(const Trajectory& trajectory);
/// A header, then one line per pose: "timestamp [ns],px,py,pz,qw,qx,qy,qz".
std::string to_euroc(const Trajectory& trajectory);

/// The parsers return code `input` with "name:line" for a wrong number of values, values that are not finite numbers,
/// quaternions that do not have unit length (within 0.01), matrices that are not rotations (within 0.001 per element),
/// and stamps that do not increase.
Result<Trajectory> parse_tum(const std::string& text, const std::string& name);
/// `stamps`: one for each line, or empty for 0, 1, 2 … s.
Result<Trajectory> parse_kitti(const std::string& text, const std::string& name, const std::vector<Stamp>& stamps);
Result<Trajectory> parse_euroc(const std::string& text, const std::string& name);

/// A trajectory read from a file.
struct LoadedTrajectory {
  Trajectory poses;
  TrajectoryFormat format = TrajectoryFormat::tum;
  bool has_stamps = true;    ///< false: a KITTI file without `times.txt` beside it; the stamps are 0, 1, 2 … s
  bool has_rotation = true;  ///< false: all rotations are the identity, so the file holds positions only
};

/// Reads a trajectory and detects its format from the content: 12 numbers per line are KITTI (stamps from `times.txt`
/// beside it), commas are EuRoC, otherwise TUM. Code `input`.
Result<LoadedTrajectory> load_trajectory(const std::string& path);

/// Length of the polyline through the positions, m.
double path_length(const Trajectory& trajectory);

}  // namespace spartan
