// Poses along a drive, as close together as its wheels need.
#pragma once

#include <functional>
#include <vector>

#include "spartan/sim/scenario.h"
#include "spartan/sim/scenario_options.h"

namespace spartan::sim::internal {

struct DrivenPose {
  double time_s = 0;
  PlanarPose pose;
  double driven_m = 0;  ///< by the wheels since the start, turns in place included
};

/// The first pose and each one after which the wheels have moved by `step_m`, interpolated between samples.
std::vector<DrivenPose> driven_poses(const std::function<PlanarPose(double time_s)>& pose_at, double seconds,
                                     const ChassisOptions& chassis, double step_m);

}  // namespace spartan::sim::internal
