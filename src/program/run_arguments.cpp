#include "program/run_arguments.h"

#include "spartan/core/files.h"

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
    auto loaded = load_options<RunOptions>(file, {}, &chosen.given);
    if (!loaded) return failure(loaded);
    chosen.options = std::move(*loaded);
    if (const auto text = read_file(file)) warn(context, renamed_options<RunOptions>(*text, file));
  }
  for (const std::string& assignment : assignments) {
    auto changed = set_option(chosen.options, assignment, &chosen.given);
    if (!changed) return failure(changed);
    chosen.options = std::move(*changed);
    warn(context, renamed_options<RunOptions>(assignment));
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

}  // namespace spartan::program
