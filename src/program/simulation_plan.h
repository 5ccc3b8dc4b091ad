// Simulations of scenarios by name or file, with their rig and drive. Shared with the Python package.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/core/threads.h"
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

/// The scenario of the address of a live simulation, "sim:SCENARIO"; none of other inputs.
std::optional<std::string> scenario_of(const std::string& input);

/// sim::simulate() and sim::open_live_simulation(). Without Embree: code `usage`, as plan_simulation().
Result<sim::SimulationReport> simulate(const SimulationPlan& plan, const sim::SimulationHooks& hooks,
                                       const ThreadPool& workers);
Result<std::unique_ptr<SampleStream>> open_simulation(SimulationPlan plan, double speed, const ThreadPool& workers);

}  // namespace spartan::program
