// A rig in words, for people who wonder whether their calibration says what they think.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// "120.0 mm", "1.200 m".
std::string describe_length(double metres);

/// "120.0 mm to the right, 0.3 mm up, 0.1 mm back; turned 0.020° to the left, …" for a camera's pose seen from
/// another optical frame.
std::string describe_relative_pose(const Pose& first_from_second);

/// Figures of one pair as `rig inspect --json` prints them.
struct PairSummary {
  std::string name;
  double baseline_m = 0;
  double focal_px = 0;
  double hfov_deg = 0, vfov_deg = 0;
};
PairSummary summarize_pair(const Rig& rig, const StereoPair& pair);

/// Sentences about every camera and pair: model, size, fields of view, where it sits, how the right eye stands
/// to the left one, the range resolution at 0.5 … 20 m for a disparity step of 0.3 px (Δz = z² c / (f b)).
std::vector<std::string> describe_rig(const Rig& rig);

/// What looks wrong with a pair by its numbers alone (find_doubts), a sentence each.
std::vector<std::string> describe_doubts(const Rig& rig, const StereoPair& pair);

}  // namespace spartan
