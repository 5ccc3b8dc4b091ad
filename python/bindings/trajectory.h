// A trajectory as a type of its own: nanobind would turn a plain std::vector into a list.
#pragma once

#include "spartan/core/trajectory.h"

namespace spartan::python {

struct TrajectoryValue {
  Trajectory poses;
};

}  // namespace spartan::python
