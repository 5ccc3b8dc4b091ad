#include "program/live_input.h"

#include "program/interrupt.h"
#include "program/simulation.h"
#include "program/simulation_plan.h"

namespace spartan::program {
void add_live_options(CLI::App& command, LiveArguments& arguments) {
  command
      .add_option("--speed", arguments.options.speed,
                  "Pace of a replay or simulation, relative to that of its stamps (default 1); raising it leaves less "
                  "time for each frame.")
      ->check(CLI::PositiveNumber);
  command.add_option("--passes", arguments.options.passes, "How often a replay plays its recording (default 1).")
      ->check(CLI::PositiveNumber);
  command.add_option("--sensors", arguments.options.sensors,
                     "Of cameras: a FIFO, created if there is none, whose lines are samples of the other sensors: "
                     "imu,STAMP_NS,… with the columns of imu.csv of a recording, and so on (default: none).");
  command
      .add_option("--set-scenario", arguments.scenario_keys,
                  "Of a simulation: set one key of the scenario, e.g. rover=ordinary. Repeatable, in this order.")
      ->allow_extra_args(false)
      ->option_text("KEY=VALUE");
}

bool is_live_input(const std::string& input) {
  return scenario_of(input) || is_live_address(input);
}

Result<std::unique_ptr<SampleStream>> open_live_input(const Context& context, const std::string& address,
                                                      const OpenOptions& open, const LiveArguments& arguments) {
  const auto scenario = scenario_of(address);
  if (!scenario) {
    LiveOptions options = arguments.options;
    options.log = context.log;
    options.should_stop = interrupted;
    return open_live_stream(address, open, options);
  }
  if (!arguments.options.sensors.empty())
    return failure(ErrorCode::usage, "brings the samples of its sensors along", address, "omit --sensors");
  SimulationArguments simulation;
  simulation.scenario = *scenario;
  simulation.set = arguments.scenario_keys;
  return open_simulation(context, simulation, arguments.options.speed);
}

}  // namespace spartan::program
