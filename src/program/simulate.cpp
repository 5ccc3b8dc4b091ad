// spartan simulate: a scenario into a recording with truth.
#include <memory>

#include "program/simulation.h"
#include "program/verbs.h"

namespace spartan::program {
namespace {

Result<ExitCode> simulate_verb(const Context& context, const SimulationArguments& arguments) {
  const auto outcome = simulate_scenario(context, arguments);
  if (!outcome) return failure(outcome);
  if (outcome->interrupted)
    return failure(ErrorCode::interrupted, "stopped on request", arguments.output, "go on with --resume");
  if (Status s = print(context.json ? outcome->json : outcome->text); !s) return failure(s);
  return kDone;
}

}  // namespace

void add_simulate(CLI::App& app, Context& context) {
  auto a = std::make_shared<SimulationArguments>();
  CLI::App* verb = add_verb(app, context, "simulate", "Simulate a drive over Mars into a recording with its truth",
                            "simulate quick -o quick_recording", [&context, a] { return simulate_verb(context, *a); });
  verb->add_option("scenario", a->scenario, "a shipped scenario's name, or a scenario file")->required();
  verb->add_option("-o,--output", a->output, "the recording's folder to make")->required();
  verb->add_option("--seed", a->seed, "in place of the scenario's")->check(CLI::NonNegativeNumber);
  verb->add_flag("--resume", a->resume, "go on where an earlier simulation of this folder stopped");
  add_threads_option(*verb, context);
  add_json_flag(*verb, context);
}

}  // namespace spartan::program
