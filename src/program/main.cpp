// The program `spartan`: reads the command line and runs the command that it names.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>
#include <string_view>

#include "program/commands.h"
#include "program/context.h"
#include "program/interrupt.h"
#include "spartan/core/stage_clock.h"
#include "spartan/core/threads.h"

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

// An empty argument, e.g. of a shell variable that is not set, would count as an option that is not given, or name the
// root folder.
void refuse_empty_arguments(CLI::App& app) {
  const CLI::Validator not_empty(
      [](const std::string& text) { return text.empty() ? "the argument is empty" : std::string(); }, "");
  for (CLI::Option* option : app.get_options()) option->check(not_empty);
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) refuse_empty_arguments(*command);
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

// "spartan rig inspect": the command that was parsed, as far as it was.
std::string command_of(const CLI::App& app) {
  const auto parsed = app.get_subcommands();
  return app.get_name() + (parsed.empty() ? "" : " " + command_of(*parsed.front()));
}

// The command line as a shell takes it: words with other characters than these in single quotes.
std::string command_line(int argc, char** argv) {
  std::string line = "spartan";
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const bool plain = !word.empty() && word.find_first_not_of(
                                            "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                            "0123456789_-+=./:,@%") == std::string::npos;
    std::string quoted;
    for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += plain ? " " + word : " '" + quoted + "'";
  }
  return line;
}

int run(int argc, char** argv) {
  CLI::App app{"Stereo vision for rovers: visual odometry, dense stereo, terrain maps and localization.", "spartan"};
  app.set_version_flag("--version", SPARTAN_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done; 1 internal fault; 2 the command line is wrong; 3 input; 4 calibration or configuration;\n"
      "5 output, memory or file descriptors; 6 done, but the rover was lost for part of the drive; 7 a bad calibration "
      "(`rig inspect --check`); 130 interrupted.");
  Context context;
  context.threads = available_cores();
  context.command_line = command_line(argc, argv);
  add_commands(app, context);
  refuse_empty_arguments(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (const std::string message = unknown_command(app, argc, argv); !message.empty()) {
      std::cerr << message;
      return kUsage;
    }
    if (e.get_exit_code() != static_cast<int>(CLI::ExitCodes::Success)) {
      std::cerr << fmt::format("error: {}; see `{} --help`\n", e.what(), command_of(app));
      return kUsage;
    }
    return app.exit(e, std::cout, std::cerr) == 0 ? kDone : kUsage;
  }

  context.log = Log::to_terminal(level_of(context));
  cv::setNumThreads(context.threads);
  listen_for_interrupts();
  if (!context.chosen) {
    context.log.error("this command needs a subcommand; see --help");
    return kUsage;
  }
  for (const std::string& warning : context.warnings) context.log.warning(warning);
  Result<ExitCode> result = context.chosen();
  // Commands of one short step ask here only.
  if (result && *result != kInterrupted) {
    if (Status status = expect_not_interrupted(); !status) result = failure(status);
  }
  if (result) return *result;
  context.log.error(result.error().message());
  return exit_code(result.error().code);
}

// The exit code of an exception, which is a bug of Spartan unless memory ran out.
int exit_code_of(const std::exception& e) {
  const auto* opencv = dynamic_cast<const cv::Exception*>(&e);
  const bool opencv_memory = opencv != nullptr && opencv->code == cv::Error::StsNoMem;
  if (const auto* memory = dynamic_cast<const std::bad_alloc*>(&e); memory != nullptr || opencv_memory) {
    const Error error = out_of_memory(memory != nullptr ? *memory : std::bad_alloc());
    std::cerr << "error: " << error.message() << '\n';
    return exit_code(error.code);
  }
  std::cerr << "error: internal error: " << e.what() << " (this is a bug of Spartan: please report the command line)\n";
  return kInternalFault;
}

// Memory may also run out in a function that must not throw, e.g. a destructor. The exception then ends here, where
// nothing may be allocated, and not in main().
[[noreturn]] void end_by_exception() noexcept {
  constexpr std::string_view kMessage =
      "error: out of memory: free memory, or use smaller images, a smaller disparity range or fewer threads; --resume "
      "continues a run\n";
  try {
    if (const std::exception_ptr exception = std::current_exception()) std::rethrow_exception(exception);
  } catch (const std::bad_alloc&) {
    // Nothing can be done about a message that cannot be written.
    [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, kMessage.data(), kMessage.size());
    std::_Exit(exit_code(ErrorCode::resources));
  } catch (const std::exception& e) {
    exit_code_of(e);
  }
  std::abort();
}

}  // namespace
}  // namespace spartan::program

int main(int argc, char** argv) {
  spartan::program::reserve_standard_streams();
  spartan::program::ignore_write_signals();
  std::set_terminate(spartan::program::end_by_exception);
  try {
    return spartan::program::run(argc, argv);
  } catch (const std::exception& e) {
    return spartan::program::exit_code_of(e);
  }
}
