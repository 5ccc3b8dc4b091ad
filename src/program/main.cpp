// The program `spartan`: reads the command line and runs the command that it names.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <iostream>
#include <opencv2/core/utility.hpp>
#include <thread>

#include "program/commands.h"
#include "program/context.h"
#include "program/interrupt.h"

namespace spartan::program {
namespace {

LogLevel level_of(const Context& context) {
  if (context.quiet) return LogLevel::error;
  return context.verbose ? LogLevel::debug : LogLevel::info;
}

void add_commands(CLI::App& app, Context& context) {
  add_demo(app, context);
  add_run(app, context);
  add_stereo(app, context);
  add_map(app, context);
  add_evaluate(app, context);
  add_rig(app, context);
  add_config(app, context);
  add_export(app, context);
  add_simulate(app, context);
  add_completion(app, context);
}

// The error text for a word in the place of a command, e.g. `spartan map foo`; empty where every such word is one.
std::string unknown_command(const CLI::App& app, int argc, char** argv) {
  const CLI::App* group = &app;
  std::string path = "spartan";
  for (int i = 1; i < argc && argv[i][0] != '-'; ++i) {
    const auto commands = group->get_subcommands([](const CLI::App*) { return true; });
    if (commands.empty()) return {};
    const auto named = std::find_if(commands.begin(), commands.end(),
                                    [&](const CLI::App* command) { return command->check_name(argv[i]); });
    if (named == commands.end())
      return fmt::format("error: '{0}' is not a {1} command; see `{1} --help`\n", argv[i], path);
    group = *named;
    path += fmt::format(" {}", argv[i]);
  }
  return {};
}

int run(int argc, char** argv) {
  CLI::App app{"Stereo vision for rovers: visual odometry, dense stereo, terrain maps and localization.", "spartan"};
  app.set_version_flag("--version", SPARTAN_VERSION);
  app.require_subcommand(1);
  Context context;
  context.threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  add_commands(app, context);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (const std::string message = unknown_command(app, argc, argv); !message.empty()) {
      std::cerr << message;
      return kUsage;
    }
    const bool help_requested = app.exit(e, std::cout, std::cerr) == 0;
    return help_requested ? kDone : kUsage;
  }

  context.log = Log::to_terminal(level_of(context));
  cv::setNumThreads(context.threads);
  listen_for_interrupts();
  if (!context.chosen) {
    context.log.error("this command needs a subcommand; see --help");
    return kUsage;
  }
  for (const std::string& warning : context.warnings) context.log.warning(warning);
  const Result<ExitCode> result = context.chosen();
  if (result) return *result;
  context.log.error(result.error().message());
  return exit_code(result.error().code);
}

}  // namespace
}  // namespace spartan::program

int main(int argc, char** argv) {
  try {
    return spartan::program::run(argc, argv);
  } catch (const std::exception& e) {
    std::cerr << "error: internal error: " << e.what()
              << " (this is a bug of Spartan: please report the command line)\n";
    return spartan::program::kInternalFault;
  }
}
