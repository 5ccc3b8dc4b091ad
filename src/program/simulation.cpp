#include "program/simulation.h"

#ifdef SPARTAN_HAS_SIM

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <string_view>
#include <utility>

#include "program/interrupt.h"
#include "program/json.h"
#include "program/progress.h"
#include "program/shipped_files.h"
#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/files.h"
#include "spartan/core/stage_clock.h"
#include "spartan/imaging/imager.h"
#include "spartan/sim/simulator.h"

namespace spartan::program {
namespace {

namespace fs = std::filesystem;

struct Text {
  std::string content, name;
  bool is_file = false;
};

std::string shipped_scenario_names() {
  std::string names;
  for (const ShippedFile& file : shipped_files()) {
    if (file.path.starts_with("scenarios/")) names += (names.empty() ? "" : ", ") + fs::path(file.path).stem().string();
  }
  return names;
}

Result<Text> find_scenario(const std::string& wanted) {
  std::error_code error;
  if (!fs::exists(wanted, error)) {
    if (const auto shipped = shipped_file("scenarios/" + wanted + ".yaml"))
      return Text{std::string(*shipped), wanted, false};
    return failure(ErrorCode::input, "is neither a file nor a shipped scenario", wanted,
                   "shipped scenarios: " + shipped_scenario_names());
  }
  const auto content = read_file(wanted);
  if (!content) return failure(content);
  return Text{*content, wanted, true};
}

// A file beside the scenario, else a shipped rig's name.
Result<Rig> find_rig(const sim::Scenario& scenario, const Text& text) {
  const fs::path beside = fs::path(text.name).parent_path() / scenario.rig;
  std::error_code error;
  if (text.is_file && fs::is_regular_file(beside, error)) return read_rig(beside.string());
  if (const auto shipped = shipped_file("rigs/" + scenario.rig + ".yaml"))
    return parse_rig_yaml(std::string(*shipped), scenario.rig);
  return failure(ErrorCode::configuration,
                 "the rig '" + scenario.rig + "' is neither a file beside the scenario nor a shipped rig",
                 option_location(text.content, text.name, "rig"));
}

Result<std::map<std::string, sim::RectifiedView>> rectified_views(const Rig& rig) {
  std::map<std::string, sim::RectifiedView> views;
  for (const StereoPair& pair : rig.pairs) {
    const auto plan = plan_rectification(*rig.find_camera(pair.left), *rig.find_camera(pair.right),
                                         rig.right_from_left(pair), "pair '" + pair.name + "'");
    if (!plan) return failure(plan);
    views[pair.name] = {plan->geometry, plan->left_from_rectified, plan->right_from_rectified};
  }
  return views;
}

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

// Without a folder.
Result<sim::SimulationRequest> read_request(const Context& context, const SimulationArguments& arguments) {
  const auto text = find_scenario(arguments.scenario);
  if (!text) return failure(text);
  auto read = sim::read_scenario(text->content, text->name);
  if (!read) {
    const auto format = detect_calibration_format(text->name, text->content);
    // Scenarios and rigs have the keys schema and name in common.
    if (format && (*format != CalibrationFormat::rig_yaml || text->content.find("\ncameras:") != std::string::npos)) {
      read.error().hint = fmt::format("this is a calibration ({}), not a scenario; the key rig of a scenario names one",
                                      name_of(*format));
    }
    return failure(read);
  }
  for (const std::string& warning : read->warnings) context.log.warning(warning);
  sim::Scenario* const scenario = &read->options;
  for (const std::string& assignment : arguments.set) {
    auto changed = sim::set_scenario_option(*scenario, assignment);
    if (!changed) return failure(changed);
    *scenario = std::move(*changed);
  }
  if (Status valid = validate(*scenario, "scenario"); !valid) return failure(valid);
  if (arguments.seed) scenario->seed = *arguments.seed;
  auto rig = find_rig(*scenario, *text);
  if (!rig) return failure(rig);
  auto drive = sim::plan_drive(*scenario, *rig, text->content, text->name);
  if (!drive) return failure(drive);
  auto views = rectified_views(sim::nominal_rig(*rig, scenario->nominal_rig));
  if (!views) return failure(views);
  return sim::SimulationRequest{*scenario, std::move(*rig), std::move(*drive), std::move(*views), {}, false};
}

}  // namespace

Result<std::unique_ptr<SampleStream>> open_simulation(const Context& context, const SimulationArguments& arguments,
                                                      double speed) {
  auto request = read_request(context, arguments);
  if (!request) return failure(request);
  return sim::open_live_simulation(std::move(*request), speed, ThreadPool(context.threads));
}

Result<SimulationOutcome> simulate_scenario(const Context& context, const SimulationArguments& arguments) {
  auto request = read_request(context, arguments);
  if (!request) return failure(request);
  request->folder = arguments.output;
  request->resume = arguments.resume;
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
  const auto report = sim::simulate(*request, hooks, ThreadPool(context.threads));
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

#else

namespace spartan::program {
namespace {

tl::unexpected<Error> no_simulator() {
  return failure(ErrorCode::usage, "this build has no simulator, because Embree was not found", {},
                 "install libembree-dev and build again");
}

}  // namespace

Result<SimulationOutcome> simulate_scenario(const Context&, const SimulationArguments&) {
  return no_simulator();
}

Result<std::unique_ptr<SampleStream>> open_simulation(const Context&, const SimulationArguments&, double) {
  return no_simulator();
}

}  // namespace spartan::program

#endif
