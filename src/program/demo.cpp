// spartan demo: simulates a short drive, processes it, and writes a report page.
#include <fmt/format.h>

#include <memory>

#include "program/commands.h"
#include "program/interrupt.h"
#include "program/progress.h"
#include "program/run_arguments.h"
#include "program/run_summary_text.h"
#include "program/sample_recording.h"
#include "program/simulation.h"
#include "program/trajectory_report.h"
#include "spartan/core/files.h"
#include "spartan/eval/trajectory_metrics.h"
#include "spartan/report/report.h"
#include "spartan/system/run.h"

namespace spartan::program {
namespace {

constexpr int kSampleFrames = 25;  // of the recording in the KITTI layout

Status say(const std::string& text) {
  return print("\n== " + text + "\n");
}

Result<ExitCode> demo(const Context& context, const std::string& scenario, const std::string& folder) {
  const std::string recording = folder + "/recording", run_folder = folder + "/run";
  if (Status s = say("Simulating a drive on Martian terrain: " + recording); !s) return failure(s);
  const auto simulated = simulate_scenario(context, {scenario, recording, std::nullopt, false});
  if (!simulated) return failure(simulated);
  if (simulated->interrupted)
    return failure(ErrorCode::interrupted, "interrupted by the user", folder, "delete the folder and start again");
  if (Status s = print(simulated->text); !s) return failure(s);

  if (Status s = say("Processing the recording: " + run_folder); !s) return failure(s);
  auto options = run_options(context, "", {});
  if (!options) return failure(options);
  RunRequest request;
  request.input = recording;
  request.output = run_folder;
  request.options = std::move(*options);
  request.threads = context.threads;
  request.memory_bytes = memory_bound(context);
  request.version = SPARTAN_VERSION;
  request.replace = context.force;
  Progress progress(context.quiet);
  RunHooks hooks;
  hooks.log = context.log;
  hooks.should_stop = interrupted;
  hooks.progress = [&progress](const RunProgress& p) {
    progress.show(p.done, p.total, fmt::format("{}, {:.1f} m", p.status, p.distance_m));
  };
  const auto outcome = run(request, hooks);
  if (!outcome) return failure(outcome);
  if (outcome->interrupted)
    return failure(ErrorCode::interrupted, "interrupted by the user", folder, "delete the folder and start again");

  if (Status s = write_kitti_sample(recording, kSampleFrames, ThreadPool(context.threads), folder + "/kitti"); !s)
    return failure(s);

  ReportRequest about;
  about.run = run_folder;
  about.recording = recording;
  about.options = request.options;
  about.whole_truth = true;
  about.threads = context.threads;
  about.command_line = context.command_line;
  about.date = date_and_time();
  about.page = folder + "/report.html";
  const auto report = make_report(about);
  if (!report) return failure(report);
  if (Status s = write_file_atomically(about.page, *report); !s) return failure(s);
  if (Status s = say("Result"); !s) return failure(s);
  const auto compared = find_trajectories(run_folder, recording, "");
  if (!compared) return failure(compared);
  const auto metrics = compare_trajectories(compared->estimate, compared->truth, {});
  if (!metrics) return failure(metrics);
  if (Status s = print(run_summary_text(outcome->summary_json, run_folder) + "\n" + table_of(*metrics, *compared)); !s)
    return failure(s);
  if (Status s = say("Report: " + about.page); !s) return failure(s);
  if (Status s = say("Recordings to try the other commands on: " + recording + ", and in the KITTI layout " + folder +
                     "/kitti");
      !s) {
    return failure(s);
  }
  return outcome->lost ? kLost : kDone;
}

}  // namespace

void add_demo(CLI::App& app, Context& context) {
  auto folder = std::make_shared<std::string>("spartan_demo");
  auto scenario = std::make_shared<std::string>("quick");
  CLI::App* command = add_command(
      app, context, "demo", "Simulate a short drive on Martian terrain, process it, and write a report page",
      "demo -o spartan_demo", [&context, scenario, folder] { return demo(context, *scenario, *folder); });
  command->add_option("scenario", *scenario, "Scenario: the name of a shipped one, or a file (default quick).");
  command->add_option("-o,--output", *folder, "Folder to create (default spartan_demo).");
  add_force_flag(*command, context);
  add_threads_option(*command, context);
}

}  // namespace spartan::program
