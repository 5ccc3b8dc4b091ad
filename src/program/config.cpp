#include <fmt/format.h>

#include <memory>

#include "program/commands.h"
#include "program/run_arguments.h"

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
  if (Status printed = print(arguments.file + " is valid\n"); !printed) return failure(printed);
  return kDone;
}

}  // namespace

void add_config(CLI::App& app, Context& context) {
  CLI::App* config = app.add_subcommand("config", "Print all options of a run, or check an option file");
  config->require_subcommand(1);
  const auto add_common = [](CLI::App* command, const std::shared_ptr<ConfigArguments>& a) {
    command->add_option("--set", a->set, "Set one option, as group.key=value. Repeatable; overrides the file.")
        ->allow_extra_args(false);
  };
  auto to_dump = std::make_shared<ConfigArguments>();
  CLI::App* dump_command =
      add_command(*config, context, "dump", "Print every option with its value and description, as YAML",
                  "config dump >my_options.yaml", [to_dump] { return dump(*to_dump); });
  dump_command->add_option("file", to_dump->file, "YAML file with options that differ from the defaults.");
  add_common(dump_command, to_dump);

  auto to_check = std::make_shared<ConfigArguments>();
  CLI::App* check_command = add_command(*config, context, "check",
                                        "Check an option file; report every unknown key and every value out of bounds",
                                        "config check my_options.yaml", [to_check] { return check(*to_check); });
  check_command->add_option("file", to_check->file, "YAML file to check.")->required();
  add_common(check_command, to_check);
}

}  // namespace spartan::program
