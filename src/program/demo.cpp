// spartan demo: simulate a short drive, run everything on it, leave a page to look at.
#include <fmt/format.h>

#include <memory>

#include "program/interrupt.h"
#include "program/progress.h"
#include "program/report.h"
#include "program/run_arguments.h"
#include "program/simulation.h"
#include "program/verbs.h"
#include "spartan/core/files.h"
#include "spartan/system/run.h"

namespace spartan::program {
namespace {

Status say(const std::string& text) {
  return print("\n== " + text + "\n");
}

Result<ExitCode> demo(const Context& context, const std::string& scenario, const std::string& folder) {
  const std::string recording = folder + "/recording", run_folder = folder + "/run";
  if (Status s = say("A rover drives over a simulated Mars: " + recording); !s) return failure(s);
  const auto simulated = simulate_scenario(context, {scenario, recording, std::nullopt, false});
  if (!simulated) return failure(simulated);
  if (simulated->interrupted) return failure(ErrorCode::interrupted, "stopped on request", folder);
  if (Status s = print(simulated->text); !s) return failure(s);

  if (Status s = say("Its images become a trajectory and terrain: " + run_folder); !s) return failure(s);
  auto options = run_options("", {});
  if (!options) return failure(options);
  RunRequest request;
  request.input = recording;
  request.output = run_folder;
  request.options = std::move(*options);
  request.threads = context.threads;
  request.version = SPARTAN_VERSION;
  Progress progress(context.quiet);
  RunHooks hooks;
  hooks.log = context.log;
  hooks.should_stop = interrupted;
  hooks.progress = [&progress](const RunProgress& p) { progress.show(p.done, p.announced, p.status); };
  const auto outcome = run(request, hooks);
  if (!outcome) return failure(outcome);
  if (outcome->interrupted) return failure(ErrorCode::interrupted, "stopped on request", folder);

  ReportRequest about;
  about.run = run_folder;
  about.recording = recording;
  about.options = request.options;
  about.whole_truth = true;
  about.threads = context.threads;
  const auto report = make_report(about);
  if (!report) return failure(report);
  const std::string page = folder + "/report.html";
  if (Status s = write_file_atomically(page, *report); !s) return failure(s);
  if (Status s = say("To look at: " + page); !s) return failure(s);
  return outcome->lost ? kLost : kDone;
}

}  // namespace

void add_demo(CLI::App& app, Context& context) {
  auto folder = std::make_shared<std::string>("spartan_demo");
  auto scenario = std::make_shared<std::string>("quick");
  CLI::App* verb =
      add_verb(app, context, "demo", "A drive over a simulated Mars, start to end, with a page to look at",
               "demo -o spartan_demo", [&context, scenario, folder] { return demo(context, *scenario, *folder); });
  verb->add_option("scenario", *scenario, "a scenario.yaml, or a shipped one's name (default quick)");
  verb->add_option("-o,--output", *folder, "the folder to make (default spartan_demo)");
  add_threads_option(*verb, context);
}

}  // namespace spartan::program
