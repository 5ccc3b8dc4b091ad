#include <fmt/format.h>

#include <memory>

#include "program/commands.h"
#include "program/run_arguments.h"

namespace spartan::program {
namespace {

const std::string kHeading =
    "# A list of all values, not a file to use as it is: keep only the lines that you change. A run derives the sizes "
    "of maps\n"
    "# from the height and range of the cameras and the noise of sensors from the recording, unless a file states "
    "them.\n";

struct ConfigArguments {
  std::string file;
  std::vector<std::string> set;
  bool all = false;
};

Result<ExitCode> dump(const Context& context, const ConfigArguments& arguments) {
  const auto options = run_options(context, arguments.file, arguments.set);
  if (!options) return failure(options);
  const std::string text = arguments.all ? dump_options(*options) : dump_basic_options(*options);
  if (Status printed = print(kHeading + text); !printed) return failure(printed);
  return kDone;
}

Result<ExitCode> check(const Context& context, const ConfigArguments& arguments) {
  const auto options = run_options(context, arguments.file, arguments.set);
  if (!options) return failure(options);
  if (Status printed = print(arguments.file + " is valid\n"); !printed) return failure(printed);
  return kDone;
}

}  // namespace

void add_config(CLI::App& app, Context& context) {
  CLI::App* config = app.add_subcommand("config", "Print the options of a run, or check an option file");
  config->require_subcommand(1);
  const auto add_common = [](CLI::App* command, const std::shared_ptr<ConfigArguments>& a) {
    command->add_option("--set", a->set, "Set one option, as group.key=value. Repeatable; overrides the file.")
        ->allow_extra_args(false)
        ->option_text("KEY=VALUE");
  };
  auto to_dump = std::make_shared<ConfigArguments>();
  CLI::App* dump_command =
      add_command(*config, context, "dump", "Print options with their values and descriptions, as YAML",
                  "config dump --all >my_options.yaml", [&context, to_dump] { return dump(context, *to_dump); });
  dump_command->add_option("file", to_dump->file, "YAML file with options that differ from the defaults.");
  dump_command->add_flag("--all", to_dump->all, "Print all options. Without it, the 30 that most users need.");
  add_common(dump_command, to_dump);

  auto to_check = std::make_shared<ConfigArguments>();
  CLI::App* check_command = add_command(
      *config, context, "check", "Check an option file; report every unknown key and every value out of bounds",
      "config check my_options.yaml", [&context, to_check] { return check(context, *to_check); });
  check_command->add_option("file", to_check->file, "YAML file to check.")->required();
  add_common(check_command, to_check);
}

}  // namespace spartan::program
