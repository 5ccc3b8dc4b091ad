#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <vector>

#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/path_text.h"
#include "bindings/python_hooks.h"
#include "bindings/threads.h"
#include "program/simulation_plan.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

std::int64_t simulate(const PathText& scenario, const PathText& output, const std::vector<std::string>& set,
                      std::optional<int> seed, bool resume, std::optional<int> threads, const nb::object& progress) {
  const ThreadPool workers = thread_pool(threads);
  PythonHooks python;
  sim::SimulationHooks hooks;
  hooks.should_stop = [&python] { return python.should_stop(); };
  if (!progress.is_none()) {
    hooks.progress = [&](const sim::SimulationProgress& p) { python.call([&] { progress(p.done, p.frames); }); };
  }
  const nb::gil_scoped_release free;
  program::SimulationPlan plan = value_of(program::plan_simulation(scenario, seed, set));
  plan.request.folder = output;
  plan.request.resume = resume;
  Result<sim::SimulationReport> report = program::simulate(plan, hooks, workers);
  python.rethrow();
  return value_of(std::move(report)).frames;
}

}  // namespace

void bind_simulation(nb::module_& m) {
  m.def("simulate", simulate, "scenario"_a, "output"_a, nb::kw_only(), "set"_a = std::vector<std::string>(),
        "seed"_a = nb::none(), "resume"_a = false, "threads"_a = nb::none(), "progress"_a = nb::none(),
        "Simulates a drive: a recording with exact ground truth in the folder `output`. `scenario`: the name of a "
        "shipped one "
        "(`quick` …) or a file. `set`: changed keys, \"path.length_m=6\". `progress`: called with the frames that are "
        "done and "
        "their number. Returns the number of frames.");
}

}  // namespace spartan::python
