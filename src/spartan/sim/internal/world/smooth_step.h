// The cubic smooth step.
#pragma once

#include <algorithm>

namespace spartan::sim::internal {

/// 3t² − 2t³ for t from 0 to 1; 0 before, 1 behind.
inline double smooth_step(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

}  // namespace spartan::sim::internal
