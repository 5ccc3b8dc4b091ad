#include "spartan/system/run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "program/calibration_advice.h"
#include "program/commands.h"
#include "program/control_lines.h"
#include "program/interrupt.h"
#include "program/json.h"
#include "program/live_input.h"
#include "program/progress.h"
#include "program/publisher.h"
#include "program/recording_arguments.h"
#include "program/rover_messages.h"
#include "program/run_arguments.h"
#include "program/run_summary_text.h"
#include "program/service_notifier.h"
#include "program/standard_error.h"
#include "program/trajectory_report.h"
#include "spartan/core/files.h"
#include "spartan/report/report.h"
#include "spartan/system/run_folder.h"

namespace spartan::program {
namespace {

// Of a live run: far above the time of any stage, even on one slow core.
constexpr double kWatchdog_s = 60;

struct RunArguments {
  std::string input, output, config, truth;
  RecordingArguments recording;
  std::vector<std::string> set;
  bool resume = false, odometry_only = false;
  int max_frames = 0;
  LiveArguments live;
  std::string pan_tilt, control;
  double panorama_every_m = 0;
  std::string publish, record_images = "pnm";
  bool no_recording = false;
  double watchdog_s = kWatchdog_s;
  std::vector<const CLI::Option*> live_only;  ///< those that have no meaning for a recording
};

// The messages of a run; none without --publish.
Result<std::unique_ptr<Publisher>> open_publisher(const RunArguments& arguments, const Context& context) {
  if (arguments.publish.empty()) return nullptr;
  if (context.json && arguments.publish == "-")
    return failure(ErrorCode::usage, "--json and --publish - both write to standard output");
  auto publisher = Publisher::open(arguments.publish);
  if (publisher && (*publisher)->port() > 0)
    context.log.info(fmt::format("messages are published at TCP port {}", (*publisher)->port()));
  return publisher;
}

// What connects a live run to the rover's computer. Borrowed; the pointers may be null.
struct RoverLinks {
  Publisher* publisher;
  ControlLines* control;
  StandardErrorBuffer* standard_error;
  ServiceNotifier& service;
};

// Ends the program, also where the stage hangs in the log, whose lock it then holds: on a lost disk.
[[noreturn]] void end_hung_run(const Log& log, const StandardErrorBuffer* standard_error, const std::string& stage,
                               double seconds) {
  const std::string text = fmt::format("stage '{}' has not ended for {:.1f} s; the run ends", stage, seconds);
  const auto said = std::make_shared<std::promise<void>>();
  std::thread([said, log, text] {
    log.error(text);
    said->set_value();
  }).detach();
  if (said->get_future().wait_for(std::chrono::seconds(1)) != std::future_status::ready) {
    const std::string line = "error: " + text + "\n";
    static_cast<void>(::write(STDERR_FILENO, line.data(), line.size()));
  }
  if (standard_error != nullptr) standard_error->flush();
  std::_Exit(kInternalFault);
}

RunHooks live_hooks(const Context& context, Progress& progress, const RoverLinks& links) {
  RunHooks hooks = run_hooks(context, progress);
  hooks.hung = [log = context.log, error = links.standard_error](const std::string& stage, double seconds) {
    end_hung_run(log, error, stage, seconds);
  };
  hooks.should_stop = [asked = hooks.should_stop, service = &links.service] {
    service->alive();
    return asked();
  };
  if (links.control != nullptr) hooks.command = [control = links.control] { return control->next(); };
  hooks.frame = [publisher = links.publisher, service = &links.service](const FrameRecord& frame) {
    service->frame(fmt::format("frame {}, odometry {}", frame.frame_id, frame.status));
    if (publisher != nullptr) publisher->publish(health_message(frame));
  };
  Publisher* const publisher = links.publisher;
  if (publisher == nullptr) return hooks;
  hooks.estimate = [publisher](const LocalizationEstimate& estimate) { publisher->publish(pose_message(estimate)); };
  hooks.map = [publisher](const MappedStop& stop, bool has_files) { publisher->publish(map_message(stop, has_files)); };
  hooks.panorama = [publisher](const PanoramaEvent& event) { publisher->publish(panorama_message(event)); };
  return hooks;
}

// Compares the run's trajectory with the truth; the summary gets the figures under "truth".
Result<std::string> score_trajectory(const RunArguments& arguments, RunOutcome& outcome) {
  const auto compared = find_trajectories(arguments.output, arguments.truth, "");
  if (!compared) return failure(compared);
  const auto scores = score(*compared, {});
  if (!scores) return failure(scores);
  Json summary = Json::parse(outcome.summary_json);
  summary["truth"] = to_json(*scores, *compared);
  outcome.summary_json = text_of(summary) + "\n";
  if (Status s = write_file_atomically(RunFolder{arguments.output}.summary(), outcome.summary_json); !s)
    return failure(s);
  return table_of(*scores, *compared);
}

// A failure to write the report does not fail the run.
Status write_report(const RunRequest& request, const std::string& truth, const Context& context) {
  ReportRequest about;
  about.run = request.output;
  about.recording = request.input;
  about.open = request.open;
  about.options = request.options;
  about.truth = truth;
  about.threads = request.threads;
  about.command_line = context.command_line;
  about.date = date_and_time();
  const RunFolder folder{request.output};
  about.page = folder.report() + "/index.html";
  const auto page = make_report(about);
  if (!page) return failure(page);
  if (Status s = make_folder(folder.report()); !s) return s;
  return write_file_atomically(about.page, *page);
}

// Where most frames were lost, the calibration may be wrong, or the cameras exchanged.
void advise(const RunRequest& request, const RunOutcome& outcome, const Context& context) {
  const auto summary = nlohmann::json::parse(outcome.summary_json);
  const int lost = summary["health"]["odometry"]["lost"].get<int>(), frames = summary["frames"].get<int>();
  if (2 * lost < frames) return;
  const std::string advice =
      calibration_advice(request.input, request.open, request.options.odometry_pair, ThreadPool(request.threads));
  context.log.warning(fmt::format("the odometry was lost in {} of {} frames; {}", lost, frames,
                                  advice.empty() ? "the calibration fits the images: dark or blurred images, little "
                                                   "texture, or a low frame rate"
                                                 : advice));
}

Result<RunOutcome> run_input(const Context& context, const RunArguments& arguments, const RunRequest& request,
                             const RunHooks& hooks) {
  if (!is_live_input(arguments.input)) return run(request, hooks);
  const auto stream = open_live_input(context, arguments.input, request.open, arguments.live);
  if (!stream) return failure(stream);
  return run_live(**stream, request, hooks);
}

// Code `usage`: an option of live runs, given for a recording.
Status expect_no_live_option(const RunArguments& arguments) {
  if (is_live_input(arguments.input)) return {};
  for (const CLI::Option* option : arguments.live_only) {
    if (option->count() == 0) continue;
    return failure(ErrorCode::usage, option->get_name() + " is an option of live runs, and this is a recording",
                   arguments.input,
                   fmt::format("omit it, or play the recording as a live stream: replay:{}", arguments.input));
  }
  return {};
}

Result<RunRequest> request_of(const Context& context, const RunArguments& arguments) {
  if (Status s = expect_no_live_option(arguments); !s) return failure(s);
  RunRequest request;
  auto chosen = choose_options(context, arguments.config, arguments.set);
  if (!chosen) return failure(chosen);
  request.options = std::move(chosen->options);
  request.given = std::move(chosen->given);
  if (arguments.odometry_only) request.options.odometry_only = true;
  auto open = open_options(arguments.recording);
  if (!open) return failure(open);
  request.open = std::move(*open);
  request.input = arguments.input;
  request.output = arguments.output;
  request.resume = arguments.resume;
  request.replace = context.force;
  request.threads = context.threads;
  request.memory_bytes = memory_bound(context);
  request.max_frames = arguments.max_frames;
  request.version = SPARTAN_VERSION;
  if (is_live_input(arguments.input)) request.watchdog_s = arguments.watchdog_s;
  request.pan_tilt = arguments.pan_tilt;
  if (arguments.panorama_every_m > 0) request.options.panorama.every_m = arguments.panorama_every_m;
  request.record = !arguments.no_recording;
  request.recorded_images = image_files_of(arguments.record_images);
  return request;
}

Result<ExitCode> run_command(const Context& context, const RunArguments& arguments) {
  const auto request = request_of(context, arguments);
  if (!request) return failure(request);
  Progress progress(context.quiet);
  if (!arguments.truth.empty()) {
    if (const auto truth = load_truth(arguments.truth); !truth) return failure(truth);
  }
  auto publisher = open_publisher(arguments, context);
  if (!publisher) return failure(publisher);
  auto control = arguments.control.empty() ? Result<std::unique_ptr<ControlLines>>()
                                           : ControlLines::open(arguments.control, context.log);
  if (!control) return failure(control);
  const bool live = is_live_input(arguments.input);
  const auto standard_error = live ? std::make_unique<StandardErrorBuffer>() : nullptr;
  ServiceNotifier service;
  auto outcome =
      run_input(context, arguments, *request,
                live_hooks(context, progress, {publisher->get(), control->get(), standard_error.get(), service}));
  service.stopping();
  if (!outcome) return failure(outcome);
  std::string text = run_summary_text(outcome->summary_json, arguments.output);
  if (!arguments.truth.empty() && !outcome->interrupted) {
    const auto table = score_trajectory(arguments, *outcome);
    if (!table) return failure(table);
    text += "\n" + *table;
  }
  if (live) accept_interrupt();
  if (!outcome->interrupted && !live) {
    if (Status s = write_report(*request, arguments.truth, context); !s)
      context.log.warning("no report was written: " + s.error().message());
  }
  if (outcome->lost && !outcome->interrupted && !live) advise(*request, *outcome, context);
  if (*publisher && (*publisher)->discarded() > 0)
    context.log.warning(fmt::format("{} messages discarded: their reader was too slow", (*publisher)->discarded()));
  const bool messages_on_output = arguments.publish == "-";
  const Status printed = messages_on_output ? Status() : print(context.json ? outcome->summary_json : text);
  if (!printed) return failure(printed);
  if (outcome->interrupted && !live) {
    return failure(ErrorCode::interrupted, "interrupted by the user", arguments.output, "continue with --resume");
  }
  return outcome->lost ? kLost : kDone;
}

// Those that have no meaning for a recording.
void add_live_run_options(CLI::App& command, RunArguments& arguments) {
  arguments.live_only = add_live_options(command, arguments.live);
  const auto live_only = [&](CLI::Option* option) { arguments.live_only.push_back(option); };
  live_only(
      command
          .add_option(
              "--panorama-every", arguments.panorama_every_m,
              "Of a live run: take a panorama each time that the rover is stationary and has driven so many metres "
              "since the last one (default: panorama.every_m of the options).")
          ->check(CLI::PositiveNumber));
  live_only(command.add_option(
      "--pan-tilt", arguments.pan_tilt,
      "Of a live run: the pan-tilt unit, flir:DEVICE (default: that of a simulation). '?pan_deg_s=30&tilt_deg_s=15' "
      "behind it sets the speeds of its axes in degrees per second (default: those of the unit)."));
  live_only(command.add_option(
      "--control", arguments.control,
      "Of a live run: a FIFO, created if there is none, whose lines are commands: panorama takes one as "
      "soon as the rover is stationary, stop ends the run (default: none)."));
  live_only(command.add_flag("--no-recording", arguments.no_recording,
                             "Of a live run: do not record the stream in the folder `live` of the run."));
  live_only(add_recorded_images_option(command, arguments.record_images));
  live_only(
      command
          .add_option("--watchdog", arguments.watchdog_s,
                      "Of a live run: end the program, with the name of the stage, if one has not ended after so many "
                      "seconds (default 60; 0: never).")
          ->check(CLI::NonNegativeNumber));
}

}  // namespace

void add_run(CLI::App& app, Context& context) {
  auto a = std::make_shared<RunArguments>();
  CLI::App* command = add_command(
      app, context, "run", "Process a recording: trajectories, disparity images, terrain maps, and a report",
      "run $SPARTAN_DATA/kitti_06 -o run_06", [&context, a] { return run_command(context, *a); });
  command
      ->add_option(
          "input", a->input,
          "Folder of the recording, whose layout (Spartan, KITTI odometry, KITTI raw, EuRoC/ASL, image folders) is "
          "detected and printed, or a video with the images of both cameras side by side; or the address of a live "
          "stream: live:RIG is the cameras with a driver in a rig file, aravis:LEFT,RIGHT and gst:PIPELINE are cameras "
          "for "
          "the rig of --rig, replay:FOLDER plays a recording at the pace of its stamps, sim:SCENARIO is a simulated "
          "rover whose cameras obey.")
      ->required();
  command
      ->add_option("-o,--output", a->output,
                   "Run folder to create. An existing one is an error without --resume or --force.")
      ->required();
  command->add_option("--rig", a->recording.rig,
                      "Calibration file to use, in any supported format (default: the recording's own). live:RIG and "
                      "sim:SCENARIO have theirs.");
  add_recording_options(*command, a->recording);
  command->add_option("--config", a->config,
                      "YAML file with options that differ from the defaults (see `spartan config dump`).");
  command->add_option("--set", a->set, "Set one option, as group.key=value. Repeatable; overrides --config.")
      ->allow_extra_args(false)
      ->option_text("KEY=VALUE");
  command->add_option(
      "--truth", a->truth,
      "Ground truth to evaluate the result against, as `spartan evaluate` does: a trajectory file (TUM, KITTI, EuRoC "
      "csv), or a recording with ground truth (default: none).");
  auto* resume = command->add_flag(
      "--resume", a->resume,
      "Continue an interrupted run in this folder. Trajectories, maps and point clouds have the same bytes as without "
      "the "
      "interruption.");
  command
      ->add_option("--max-frames", a->max_frames,
                   "Stop after this many stereo frames of the odometry pair, counted from the start of the recording; "
                   "frames with missing images count (default 0: all). A run that has as many already is not shortened "
                   "by --resume.")
      ->check(non_negative_number());
  command->add_flag("--odometry-only", a->odometry_only,
                    "Run the visual odometry alone: no localization, maps, SLAM, disparity images or "
                    "point clouds.");
  command->add_option(
      "--publish", a->publish,
      "Publish poses at the rate of the IMU, health and maps as JSON lines: to - (standard output, without the "
      "summary), to a FIFO, to tcp:PORT of this computer, or to tcp:ADDRESS:PORT (default: nowhere).");
  add_live_run_options(*command, *a);
  add_force_flag(*command, context)->excludes(resume);
  add_threads_option(*command, context);
  add_memory_option(*command, context);
  add_json_flag(*command, context);
}

}  // namespace spartan::program
