#include <fmt/format.h>

#include <memory>

#include "program/run_arguments.h"
#include "program/verbs.h"

namespace spartan::program {
namespace {

struct ConfigArguments {
  std::string file;
  std::vector<std::string> set;
};

Result<ExitCode> dump(const ConfigArguments& arguments) {
  const auto options = run_options(arguments.file, arguments.set);
  if (!options) return failure(options);
  if (Status printed = print(dump_options(*options)); !printed) return failure(printed);
  return kDone;
}

Result<ExitCode> check(const ConfigArguments& arguments) {
  const auto options = run_options(arguments.file, arguments.set);
  if (!options) return failure(options);
  if (Status printed = print(arguments.file + " is good\n"); !printed) return failure(printed);
  return kDone;
}

}  // namespace

void add_config(CLI::App& app, Context& context) {
  CLI::App* config = app.add_subcommand("config", "Options of a run: show them all, or check a file");
  config->require_subcommand(1);
  const auto add_common = [](CLI::App* verb, const std::shared_ptr<ConfigArguments>& a) {
    verb->add_option("--set", a->set, "one option, as group.key=value; may be given again")->allow_extra_args(false);
  };
  auto to_dump = std::make_shared<ConfigArguments>();
  CLI::App* dump_verb = add_verb(*config, context, "dump", "Print every option with its value and meaning, as YAML",
                                 "config dump >my_options.yaml", [to_dump] { return dump(*to_dump); });
  dump_verb->add_option("file", to_dump->file, "options that differ from the defaults");
  add_common(dump_verb, to_dump);

  auto to_check = std::make_shared<ConfigArguments>();
  CLI::App* check_verb = add_verb(*config, context, "check", "Say whether an option file is good, and what is not",
                                  "config check my_options.yaml", [to_check] { return check(*to_check); });
  check_verb->add_option("file", to_check->file, "the YAML file")->required();
  add_common(check_verb, to_check);
}

}  // namespace spartan::program
