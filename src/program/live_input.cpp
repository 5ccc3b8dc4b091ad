#include "program/live_input.h"

#include "program/interrupt.h"
#include "program/simulation.h"
#include "program/simulation_plan.h"

namespace spartan::program {
namespace {

// Code `usage`: what was given has no meaning for this kind of stream.
Status expect_meaning(const std::string& address, bool is_simulation, const OpenOptions& open,
                      const LiveArguments& arguments) {
  const bool is_replay = address.starts_with("replay:"), is_cameras = !is_simulation && !is_replay;
  const auto rejected = [&](const std::string& what, const std::string& option) {
    return failure(ErrorCode::usage, what, address, "omit " + option);
  };
  if (!is_cameras && !arguments.options.sensors.empty())
    return rejected("brings the samples of its sensors along", "--sensors");
  if (is_simulation && !open.rig_file.empty()) return rejected("has the rig of its scenario", "--rig");
  if (is_cameras && arguments.options.speed != 1) return rejected("has the pace of its cameras", "--speed");
  if (!is_replay && arguments.options.passes != 1) return rejected("is no replay and cannot be repeated", "--passes");
  if (!is_simulation && !arguments.scenario_keys.empty())
    return rejected("is no simulation and has no scenario", "--set-scenario");
  if (!is_replay && (open.format || open.fps > 0 || open.bits > 0 || !open.left_images.empty() ||
                     !open.right_images.empty() || !open.times_file.empty()))
    return rejected("is not read from files", "--format, --left, --right, --times, --fps and --bits");
  return {};
}

}  // namespace

std::vector<const CLI::Option*> add_live_options(CLI::App& command, LiveArguments& arguments) {
  return {
      command
          .add_option("--speed", arguments.options.speed,
                      "Pace of a replay or simulation, relative to that of its stamps (default 1); raising it leaves "
                      "less time for each frame.")
          ->check(CLI::PositiveNumber),
      command.add_option("--passes", arguments.options.passes, "How often a replay plays its recording (default 1).")
          ->check(CLI::PositiveNumber),
      command.add_option("--sensors", arguments.options.sensors,
                         "Of cameras: a FIFO, created if there is none, whose lines are samples of the other sensors: "
                         "imu,STAMP_NS,… with the columns of imu.csv of a recording, and so on (default: none)."),
      command
          .add_option("--set-scenario", arguments.scenario_keys,
                      "Of a simulation: set one key of the scenario, e.g. rover=ordinary. Repeatable, in this order.")
          ->allow_extra_args(false)
          ->option_text("KEY=VALUE")};
}

bool is_live_input(const std::string& input) {
  return scenario_of(input) || is_live_address(input);
}

Result<std::unique_ptr<SampleStream>> open_live_input(const Context& context, const std::string& address,
                                                      const OpenOptions& open, const LiveArguments& arguments) {
  const auto scenario = scenario_of(address);
  if (Status s = expect_meaning(address, scenario.has_value(), open, arguments); !s) return failure(s);
  if (!scenario) {
    LiveOptions options = arguments.options;
    options.log = context.log;
    options.should_stop = interrupted;
    return open_live_stream(address, open, options);
  }
  SimulationArguments simulation;
  simulation.scenario = *scenario;
  simulation.set = arguments.scenario_keys;
  return open_simulation(context, simulation, arguments.options.speed);
}

}  // namespace spartan::program
