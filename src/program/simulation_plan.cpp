#include "program/simulation_plan.h"

namespace spartan::program {

std::optional<std::string> scenario_of(const std::string& input) {
  const std::string scheme = "sim:";
  return input.starts_with(scheme) ? std::optional(input.substr(scheme.size())) : std::nullopt;
}

}  // namespace spartan::program

#ifdef SPARTAN_HAS_SIM

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "program/shipped_files.h"
#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/files.h"
#include "spartan/imaging/imager.h"

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
  // A folder of that name, e.g. of an earlier recording, is not meant.
  if (!fs::exists(wanted, error) || fs::is_directory(wanted, error)) {
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

}  // namespace

Result<SimulationPlan> plan_simulation(const std::string& name, std::optional<int> seed,
                                       const std::vector<std::string>& assignments) {
  const auto text = find_scenario(name);
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
  sim::Scenario* const scenario = &read->options;
  for (const std::string& assignment : assignments) {
    auto changed = sim::set_scenario_option(*scenario, assignment);
    if (!changed) return failure(changed);
    *scenario = std::move(*changed);
  }
  if (Status valid = validate(*scenario, "scenario"); !valid) return failure(valid);
  if (seed) scenario->seed = *seed;
  auto rig = find_rig(*scenario, *text);
  if (!rig) return failure(rig);
  auto drive = sim::plan_drive(*scenario, *rig, text->content, text->name);
  if (!drive) return failure(drive);
  auto views = rectified_views(sim::nominal_rig(*rig, scenario->nominal_rig));
  if (!views) return failure(views);
  return SimulationPlan{{*scenario, std::move(*rig), std::move(*drive), std::move(*views), {}, false},
                        std::move(read->warnings)};
}

Result<sim::SimulationReport> simulate(const SimulationPlan& plan, const sim::SimulationHooks& hooks,
                                       const ThreadPool& workers) {
  return sim::simulate(plan.request, hooks, workers);
}

Result<std::unique_ptr<SampleStream>> open_simulation(SimulationPlan plan, double speed, const ThreadPool& workers) {
  return sim::open_live_simulation(std::move(plan.request), speed, workers);
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

Result<SimulationPlan> plan_simulation(const std::string&, std::optional<int>, const std::vector<std::string>&) {
  return no_simulator();
}

Result<sim::SimulationReport> simulate(const SimulationPlan&, const sim::SimulationHooks&, const ThreadPool&) {
  return no_simulator();
}

Result<std::unique_ptr<SampleStream>> open_simulation(SimulationPlan, double, const ThreadPool&) {
  return no_simulator();
}

}  // namespace spartan::program

#endif
