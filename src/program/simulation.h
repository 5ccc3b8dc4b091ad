// Scenarios by name or file, and their simulation with progress.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "program/context.h"
#include "spartan/camera/sample_stream.h"
#include "spartan/core/result.h"

namespace spartan::program {

struct SimulationArguments {
  std::string scenario, output;
  std::optional<int> seed;
  bool resume = false;
  std::vector<std::string> set = {};  ///< assignments "group.key=value"
};

/// Rays cast and time, as `simulate --json` prints them.
struct SimulationOutcome {
  std::string json;
  std::string text;
  bool interrupted = false;
};

/// Reads and checks the scenario (the name of a shipped one, or a file), then renders it. Without Embree: code `usage`.
Result<SimulationOutcome> simulate_scenario(const Context& context, const SimulationArguments& arguments);

/// The scenario as a live stream (sim::open_live_simulation()); `output` and `resume` are not used. Errors as above.
Result<std::unique_ptr<SampleStream>> open_simulation(const Context& context, const SimulationArguments& arguments,
                                                      double speed);

}  // namespace spartan::program
