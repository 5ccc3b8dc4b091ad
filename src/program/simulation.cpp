#include "program/simulation.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <string_view>
#include <utility>

#include "program/interrupt.h"
#include "program/json.h"
#include "program/progress.h"
#include "program/simulation_plan.h"
#include "spartan/core/files.h"
#include "spartan/core/stage_clock.h"
#include "spartan/sim/simulator.h"

namespace spartan::program {
namespace {

namespace fs = std::filesystem;

// A recording of the simulator is set aside for a new one.
Result<ReplacedFolder> replace_recording(const std::string& folder) {
  constexpr std::array<std::string_view, 6> kEntries{"frames.csv", "recording.yaml", "rig.yaml",
                                                     "images",     "sensors",        "truth"};
  std::error_code error;
  if (fs::exists(folder + "/frames.csv", error) && !fs::exists(folder + "/truth/scenario.yaml", error)) {
    return failure(ErrorCode::output, "holds a recording that was not simulated: it is not replaced", folder,
                   "choose another folder with -o");
  }
  return ReplacedFolder::set_aside(folder, kEntries);
}

Result<SimulationPlan> plan_with_warnings(const Context& context, const SimulationArguments& arguments) {
  auto plan = plan_simulation(arguments.scenario, arguments.seed, arguments.set);
  if (plan) {
    for (const std::string& warning : plan->warnings) context.log.warning(warning);
  }
  return plan;
}

}  // namespace

Result<std::unique_ptr<SampleStream>> open_simulation(const Context& context, const SimulationArguments& arguments,
                                                      double speed) {
  auto plan = plan_with_warnings(context, arguments);
  if (!plan) return failure(plan);
  return open_simulation(std::move(*plan), speed, ThreadPool(context.threads));
}

Result<SimulationOutcome> simulate_scenario(const Context& context, const SimulationArguments& arguments) {
  auto plan = plan_with_warnings(context, arguments);
  if (!plan) return failure(plan);
  plan->request.folder = arguments.output;
  plan->request.resume = arguments.resume;
  if (!arguments.resume) {
    if (Status s = expect_new_folder(context, arguments.output); !s) return failure(s);
  }
  auto replaced = context.force ? replace_recording(arguments.output) : Result<ReplacedFolder>();
  if (!replaced) return failure(replaced);

  Progress progress(context.quiet);
  sim::SimulationHooks hooks;
  hooks.should_stop = interrupted;
  hooks.progress = [&progress](const sim::SimulationProgress& p) { progress.show(p.done, p.frames, "frames"); };
  Stopwatch watch;
  const auto report = simulate(*plan, hooks, ThreadPool(context.threads));
  if (!report) return failure(report);
  replaced->discard();
  const double seconds = 1e-3 * watch.lap();
  const double rate =
      report->render_seconds > 0 ? static_cast<double>(report->rays) / report->render_seconds / context.threads : 0;
  const Json json{
      {"schema", 1},        {"recording", arguments.output},   {"frames", report->frames}, {"rays", report->rays},
      {"seconds", seconds}, {"rays_per_second_per_core", rate}};
  SimulationOutcome outcome;
  outcome.json = text_of(json) + "\n";
  outcome.text = fmt::format("{} frames in {:.1f} s, {:.2f} million rays per second and core\nrecording in {}\n",
                             report->frames, seconds, rate / 1e6, arguments.output);
  outcome.interrupted = report->interrupted;
  return outcome;
}

}  // namespace spartan::program
