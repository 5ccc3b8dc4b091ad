// True poses of the cameras on the body during a drive.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "spartan/core/pose.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/scenario.h"

namespace spartan::sim::internal {

/// The true rig with errors that change over the drive: those of the pan-tilt units at each positioning, and the drift
/// of the right cameras.
class CameraPoses {
 public:
  CameraPoses(const Rig& true_rig, const RoverErrorOptions& errors, int scenario_seed, double drive_s);

  /// The pose at a time in the exposure of a planned frame.
  Pose body_from_camera(const std::string& camera, const PlannedFrame& frame, double time_s) const;

  /// True angles of a pan-tilt unit in a planned frame.
  struct Angles {
    double pan_rad = 0, tilt_rad = 0;
  };
  Angles angles(const std::string& unit, const PlannedFrame& frame) const;

 private:
  // The rotation of a camera since the start, in its frame; none for cameras that do not drift.
  std::optional<Pose> drift_of(const std::string& camera, double time_s) const;

  Rig rig_;
  double noise_rad_ = 0, drive_s_ = 0;
  std::uint64_t seed_ = 0;
  std::map<std::string, Angles> bias_;            // of each pan-tilt unit
  std::map<std::string, Eigen::Vector3d> drift_;  // of each right camera at the end of the drive, rotation vector
};

}  // namespace spartan::sim::internal
