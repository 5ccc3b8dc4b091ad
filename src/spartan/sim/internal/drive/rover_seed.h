// Seed of the errors of a rover.
#pragma once

#include <cstdint>

#include "spartan/sim/sensor_options.h"

namespace spartan::sim::internal {

/// The same for all errors of one rover on one drive. Disjoint for different `errors.seed`: the multiplier is odd.
inline std::uint64_t rover_seed(const RoverErrorOptions& errors, int scenario_seed) {
  constexpr std::uint64_t kStride = 0xD1B54A32D192ED03U;
  return static_cast<std::uint64_t>(scenario_seed) + static_cast<std::uint64_t>(errors.seed) * kStride;
}

}  // namespace spartan::sim::internal
