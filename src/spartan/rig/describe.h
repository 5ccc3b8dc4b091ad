// A rig as text, to check that a calibration file means what its author intended.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// "120.0 mm", "1.200 m".
std::string describe_length(double metres);

/// "120.0 mm to the right, 0.3 mm up, 0.1 mm back; rotated 0.020° to the left, …": pose of the second optical frame in
/// the first one (x right, y down, z forward).
std::string describe_relative_pose(const Pose& first_from_second);

/// Geometry of one pair as `rig inspect --json` prints it; focal length and fields of view are those of the left
/// camera.
struct PairSummary {
  std::string name;
  double baseline_m = 0;
  double focal_px = 0;                ///< pixels per radian on the optical axis
  double hfov_deg = 0, vfov_deg = 0;  ///< through the image centre, from border to border; NaN where undefined
};
PairSummary summarize_pair(const Rig& rig, const StereoPair& pair);

/// Lines about every camera and pair: model, image size, fields of view, pose in the body frame, pose of the right
/// camera relative to the left one, and range resolution at 0.5 … 20 m for 0.3 px of disparity (Δz = z² c / (f b)).
std::vector<std::string> describe_rig(const Rig& rig);

/// One line per finding of plausibility_findings(), what is implausible about a pair by its numbers alone.
std::vector<std::string> describe_plausibility(const Rig& rig, const StereoPair& pair);

}  // namespace spartan
