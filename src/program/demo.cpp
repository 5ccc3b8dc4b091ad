// spartan demo: simulates a short drive, processes it, and writes a report page.
#include <fmt/format.h>

#include <array>
#include <memory>
#include <string_view>

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

tl::unexpected<Error> demo_interrupted(const std::string& folder) {
  return failure(ErrorCode::interrupted, "interrupted by the user", folder, "start again with --force");
}

RunRequest run_request(const Context& context, const std::string& recording, const std::string& output,
                       const RunOptions& options) {
  RunRequest request;
  request.input = recording;
  request.output = output;
  request.options = options;
  request.threads = context.threads;
  request.memory_bytes = memory_bound(context);
  request.version = SPARTAN_VERSION;
  request.replace = context.force;
  return request;
}

Status write_page(const Context& context, const RunRequest& request, const std::string& page) {
  ReportRequest about;
  about.run = request.output;
  about.recording = request.input;
  about.options = request.options;
  about.whole_truth = true;
  about.threads = context.threads;
  about.command_line = context.command_line;
  about.date = date_and_time();
  about.page = page;
  const auto report = make_report(about);
  return report ? write_file_atomically(page, *report) : Status(failure(report));
}

Status print_result(const RunRequest& request, const RunOutcome& outcome) {
  if (Status s = say("Result"); !s) return s;
  const auto compared = find_trajectories(request.output, request.input, "");
  if (!compared) return failure(compared);
  const auto scores = score(*compared, {});
  if (!scores) return failure(scores);
  return print(run_summary_text(outcome.summary_json, request.output) + "\n" + table_of(*scores, *compared));
}

// The first frames in the layout of KITTI, in place of those of an earlier demo.
Status make_sample(const Context& context, const std::string& recording, const std::string& folder) {
  constexpr std::array<std::string_view, 5> kEntries{"image_0", "image_1", "calib.txt", "times.txt", "poses.txt"};
  auto replaced = ReplacedFolder::set_aside(folder, kEntries);
  if (!replaced) return failure(replaced);
  if (Status s = write_kitti_sample(recording, kSampleFrames, ThreadPool(context.threads), folder); !s) return s;
  replaced->discard();
  return say("Recordings to try the other commands on: " + recording + ", and in the KITTI layout " + folder);
}

Result<ExitCode> demo(const Context& context, const std::string& scenario, const std::string& folder) {
  const std::string recording = folder + "/recording", sample = folder + "/kitti", page = folder + "/report.html";
  for (const std::string& part : {recording, folder + "/run", sample}) {
    if (Status s = expect_new_folder(context, part); !s) return failure(s);
  }
  if (Status s = expect_new_file(context, page); !s) return failure(s);
  if (Status s = say("Simulating a drive on Martian terrain: " + recording); !s) return failure(s);
  const auto simulated = simulate_scenario(context, {scenario, recording, std::nullopt, false});
  if (!simulated) return failure(simulated);
  if (simulated->interrupted) return demo_interrupted(folder);
  if (Status s = print(simulated->text); !s) return failure(s);

  const auto options = run_options(context, "", {});
  if (!options) return failure(options);
  const RunRequest request = run_request(context, recording, folder + "/run", *options);
  if (Status s = say("Processing the recording: " + request.output); !s) return failure(s);
  Progress progress(context.quiet);
  const auto outcome = run(request, run_hooks(context, progress));
  if (!outcome) return failure(outcome);
  if (outcome->interrupted) return demo_interrupted(folder);
  if (Status s = write_page(context, request, page); !s) return failure(s);
  if (Status s = print_result(request, *outcome); !s) return failure(s);
  if (Status s = say("Report: " + page); !s) return failure(s);
  if (Status s = make_sample(context, recording, sample); !s) return failure(s);
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
