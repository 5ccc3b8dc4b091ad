#include "program/run_arguments.h"

namespace spartan::program {

Result<RunOptions> run_options(const std::string& file, const std::vector<std::string>& assignments, GivenKeys* given) {
  RunOptions options;
  if (!file.empty()) {
    auto loaded = load_options<RunOptions>(file, {}, given);
    if (!loaded) return failure(loaded);
    options = std::move(*loaded);
  }
  for (const std::string& assignment : assignments) {
    auto changed = set_option(options, assignment, given);
    if (!changed) return failure(changed);
    options = std::move(*changed);
  }
  if (Status status = validate(options, file.empty() ? "--set" : file); !status) return failure(status);
  return options;
}

}  // namespace spartan::program
