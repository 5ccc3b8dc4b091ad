// spartan.run(): a whole recording or live stream into a run folder.
#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/option_classes.h"
#include "bindings/path_text.h"
#include "bindings/python_hooks.h"
#include "bindings/recordings.h"
#include "bindings/threads.h"
#include "program/simulation_plan.h"
#include "spartan/core/files.h"
#include "spartan/core/stage_clock.h"
#include "spartan/report/report.h"
#include "spartan/system/run.h"
#include "spartan/system/run_folder.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

// The noise that a recording states does not replace options that were changed.
GivenKeys changed_keys(const RunOptions& options) {
  GivenKeys keys;
  for (const OptionLine& line : changed_options(options)) keys.add(line.key);
  return keys;
}

Result<std::unique_ptr<SampleStream>> open_stream(const std::string& address, const OpenOptions& open,
                                                  const LiveOptions& live, int threads) {
  if (const auto scenario = program::scenario_of(address)) {
    if (!live.sensors.empty())
      return failure(ErrorCode::usage, "brings the samples of its sensors along", address, "omit sensors");
    if (!open.rig_file.empty()) return failure(ErrorCode::usage, "has the rig of its scenario", address, "omit rig");
    auto plan = program::plan_simulation(*scenario, {}, {});
    if (!plan) return failure(plan);
    return program::open_simulation(std::move(*plan), live.speed, ThreadPool(threads));
  }
  return open_live_stream(address, open, live);
}

// Returns the summary.
std::string run_input(const RunRequest& request, const RunHooks& hooks, LiveOptions live, PythonHooks& python) {
  const nb::gil_scoped_release free;
  Result<RunOutcome> outcome;
  if (program::scenario_of(request.input) || is_live_address(request.input)) {
    live.log = hooks.log;
    live.should_stop = hooks.should_stop;
    const auto stream = value_of(open_stream(request.input, request.open, live, request.threads));
    outcome = run_live(*stream, request, hooks);
  } else if (!live.sensors.empty()) {
    outcome = failure(ErrorCode::usage, "is a recording, which has its sensors", request.input, "omit sensors");
  } else {
    outcome = run(request, hooks);
  }
  python.rethrow();
  return value_of(std::move(outcome)).summary_json;
}

// Of the module logging.
int level_of(LogLevel level) {
  constexpr int kDebug = 10, kInfo = 20, kWarning = 30, kError = 40;
  if (level == LogLevel::debug) return kDebug;
  if (level == LogLevel::info) return kInfo;
  return level == LogLevel::warning ? kWarning : kError;
}

std::string run_folder(const PathText& input, const PathText& output, const RunOptions* options,
                       const OpenOptions& open, RunRequest request, const LiveOptions& live, const nb::object& progress,
                       const nb::object& frame, const nb::object& log) {
  request.input = input;
  request.output = output;
  request.open = open;
  if (options != nullptr) {
    check(validate(*options, "options"));
    request.options = *options;
    request.given = changed_keys(*options);
  }
  request.memory_bytes = available_memory_bytes() / 5 * 4;
  request.version = SPARTAN_VERSION;
  PythonHooks python;
  RunHooks hooks;
  hooks.log = Log::to_function([&](LogLevel level, std::string_view text) {
    python.call([&] { log(level_of(level), nb::str(text.data(), text.size())); });
  });
  hooks.should_stop = [&python] { return python.should_stop(); };
  if (!progress.is_none()) {
    hooks.progress = [&](const RunProgress& p) { python.call([&] { progress(p); }); };
  }
  if (!frame.is_none()) {
    hooks.frame = [&](const FrameRecord& record) { python.call([&] { frame(record); }); };
  }
  return run_input(request, hooks, live, python);
}

void report(const PathText& run, const PathText& recording, const OpenOptions& open, const PathText& page,
            const std::optional<PathText>& truth, std::optional<int> threads) {
  const int count = thread_count(threads);
  const nb::gil_scoped_release free;
  ReportRequest about;
  about.run = run;
  about.recording = recording;
  about.open = open;
  const RunFolder folder{run};
  about.options = value_of(load_options<RunOptions>(folder.config()));
  if (truth) about.truth = *truth;
  about.threads = count;
  about.page = page;
  const std::string html = value_of(make_report(about));
  check(write_file_atomically(page, html));
}

}  // namespace

void bind_runs(nb::module_& m) {
  nb::class_<RunProgress>(m, "RunProgress", "How far a run is.")
      .def_ro("done", &RunProgress::done, "Frames of the odometry's pair, missing ones included.")
      .def_ro("total", &RunProgress::total, "0: unknown.")
      .def_ro("distance_m", &RunProgress::distance_m)
      .def_ro("status", &RunProgress::status, "Of the odometry at the last frame.")
      .def("__repr__", [](const RunProgress& p) {
        return fmt::format("<RunProgress {}/{}, {:.1f} m, {}>", p.done, p.total, p.distance_m, p.status);
      });
  m.def(
      "run_into_folder",
      [](const PathText& input, const PathText& output, const RunOptions* options, const OpenOptions& open,
         std::optional<int> threads, int max_frames, bool resume, bool replace, double speed, int passes,
         const std::optional<PathText>& sensors, const nb::object& progress, const nb::object& frame,
         const nb::object& log) {
        if (max_frames < 0) throw nb::value_error("max_frames: must not be negative");
        RunRequest request;
        request.threads = thread_count(threads);
        request.max_frames = max_frames;
        request.resume = resume;
        request.replace = replace;
        request.record = true;  // of a live stream
        LiveOptions live;
        live.speed = speed;
        live.passes = passes;
        if (sensors) live.sensors = *sensors;
        return run_folder(input, output, options, open, request, live, progress, frame, log);
      },
      "input"_a, "output"_a, "options"_a.none() = nb::none(), nb::kw_only(), "open"_a, "threads"_a = nb::none(),
      "max_frames"_a = 0, "resume"_a = false, "replace"_a = false, "speed"_a = 1.0, "passes"_a = 1,
      "sensors"_a = nb::none(), "progress"_a = nb::none(), "frame"_a = nb::none(), "log"_a,
      "See spartan.run(). Returns the text of summary.json.");
  m.def("write_report", report, "run"_a, "recording"_a, "open"_a, "page"_a, "truth"_a = nb::none(),
        "threads"_a = nb::none(), "Writes the report page of a run folder.");
}

}  // namespace spartan::python
