// The plan of a drive: where the rover is at each time, and when each pair takes a frame.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/path.h"
#include "spartan/sim/scenario_options.h"

namespace spartan::sim {

/// One stereo frame of one pair.
struct PlannedFrame {
  double time_s = 0;  ///< middle of the exposure
  std::string pair;
  std::int64_t position_id = 0;  ///< shared by all frames taken at one place
  double pan_rad = 0, tilt_rad = 0;
};

/// Planar motion over time and the frames to take. A rover that follows it exactly is simulated by BodyMotion.
class Drive {
 public:
  /// The rover is stationary for this time before it moves, so that gravity can be measured.
  static constexpr double kInitialStop_s = 2;

  /// Lays the path and plans the frames of the rig's pairs. Errors: `configuration` for a path that cannot be built, or
  /// that is shorter than the distance of a stop.
  static Result<Drive> plan(const PathOptions& path, const CaptureOptions& capture, const Rig& rig);

  double seconds() const { return seconds_; }
  /// Planar pose at a time, clamped to the drive.
  PlanarPose at(double time_s) const;
  /// In order of time.
  const std::vector<PlannedFrame>& frames() const { return frames_; }
  /// Points along the driven path, at most 2 · Motion::kStep_m apart.
  std::vector<PlanarPose> track() const;

 private:
  struct Segment {
    double from_s;
    Motion motion;
  };
  class Planner;
  std::vector<Segment> segments_;
  std::vector<PlannedFrame> frames_;
  double seconds_ = 0;
};

}  // namespace spartan::sim
