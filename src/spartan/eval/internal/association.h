// Association of the poses of two trajectories by time.
#pragma once

#include "spartan/core/result.h"
#include "spartan/core/trajectory.h"

namespace spartan::internal {

/// Two trajectories of equal length whose poses correspond one to one.
struct AssociatedTrajectories {
  Trajectory estimate, truth;
};

/// Pairs every pose of the estimate with the truth pose nearest in time, at most `max_dt_s` (seconds) away. Where
/// several poses share the nearest truth pose, the one nearest to it is kept. Fails with code `input` where no pair is
/// found.
Result<AssociatedTrajectories> associate(const Trajectory& estimate, const Trajectory& truth, double max_dt_s);

}  // namespace spartan::internal
