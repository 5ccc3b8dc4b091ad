// What a simulation needs: the scenario by name or file, its rig, and the drive. Shared with the Python package.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/sim/simulator.h"

namespace spartan::program {

struct SimulationPlan {
  sim::SimulationRequest request;     ///< without a folder
  std::vector<std::string> warnings;  ///< of former keys
};

/// Reads and checks a scenario, the name of a shipped one or a file, with `assignments` "group.key=value". Codes:
/// `input` (no such scenario), `configuration`, `usage` (an assignment).
Result<SimulationPlan> plan_simulation(const std::string& name, std::optional<int> seed,
                                       const std::vector<std::string>& assignments);

}  // namespace spartan::program
