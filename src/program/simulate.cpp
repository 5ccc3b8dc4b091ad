// spartan simulate: renders a scenario into a recording with ground truth.
#include <memory>

#include "program/commands.h"
#include "program/simulation.h"

namespace spartan::program {
namespace {

Result<ExitCode> simulate_command(const Context& context, const SimulationArguments& arguments) {
  const auto outcome = simulate_scenario(context, arguments);
  if (!outcome) return failure(outcome);
  if (outcome->interrupted)
    return failure(ErrorCode::interrupted, "interrupted by the user", arguments.output, "continue with --resume");
  if (Status s = print(context.json ? outcome->json : outcome->text); !s) return failure(s);
  return kDone;
}

}  // namespace

void add_simulate(CLI::App& app, Context& context) {
  auto a = std::make_shared<SimulationArguments>();
  CLI::App* command =
      add_command(app, context, "simulate", "Simulate a drive on Martian terrain: a recording with exact ground truth",
                  "simulate quick -o quick_recording", [&context, a] { return simulate_command(context, *a); });
  command->add_option("scenario", a->scenario, "Scenario: the name of a shipped one, or a file.")->required();
  command->add_option("-o,--output", a->output, "Folder of the recording to create.")->required();
  command->add_option("--seed", a->seed, "Seed of all random numbers (default: that of the scenario).")
      ->check(non_negative_number());
  command->add_option("--set", a->set, "Set one key of the scenario, e.g. rover=ordinary. Repeatable, in this order.")
      ->allow_extra_args(false)
      ->option_text("KEY=VALUE");
  auto* resume = command->add_flag(
      "--resume", a->resume,
      "Continue an interrupted simulation in this folder. The files are the same as without the interruption.");
  add_force_flag(*command, context)->excludes(resume);
  add_threads_option(*command, context);
  add_json_flag(*command, context);
}

}  // namespace spartan::program
