#include "program/run_arguments.h"

#include <fmt/format.h>

#include "program/interrupt.h"

namespace spartan::program {
namespace {

void warn(const Context& context, const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) context.log.warning(warning);
}

}  // namespace

Result<ChosenOptions> choose_options(const Context& context, const std::string& file,
                                     const std::vector<std::string>& assignments) {
  ChosenOptions chosen;
  if (!file.empty()) {
    auto loaded = read_options_file<RunOptions>(file);
    if (!loaded) return failure(loaded);
    chosen.options = std::move(loaded->options);
    chosen.given = std::move(loaded->given);
    warn(context, loaded->warnings);
  }
  for (const std::string& assignment : assignments) {
    auto changed = read_assignment(assignment, std::move(chosen.options));
    if (!changed) return failure(changed);
    chosen.options = std::move(changed->options);
    chosen.given.add(changed->given);
    warn(context, changed->warnings);
  }
  if (Status status = validate(chosen.options, file.empty() ? "--set" : file); !status) return failure(status);
  return chosen;
}

Result<RunOptions> run_options(const Context& context, const std::string& file,
                               const std::vector<std::string>& assignments) {
  auto chosen = choose_options(context, file, assignments);
  if (!chosen) return failure(chosen);
  return std::move(chosen->options);
}

namespace {

// The word of the summary for a status of the files.
std::string status_text(const std::string& status) {
  if (status == "standing") return "stationary";
  return status == "missing" ? "image missing" : status;
}

}  // namespace

RunHooks run_hooks(const Context& context, Progress& progress) {
  RunHooks hooks;
  hooks.log = context.log;
  hooks.should_stop = interrupted;
  hooks.progress = [&progress](const RunProgress& p) {
    progress.show(p.done, p.total, fmt::format("{}, {:.1f} m", status_text(p.status), p.distance_m));
  };
  return hooks;
}

}  // namespace spartan::program
