// The program `spartan`: reads the command line and runs the command that it names.
#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "program/command_line.h"
#include "program/commands.h"
#include "program/context.h"
#include "program/interrupt.h"
#include "program/json.h"
#include "program/version.h"
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
  add_record(app, context);
  add_stereo(app, context);
  add_map(app, context);
  add_features(app, context);
  add_evaluate(app, context);
  add_rig(app, context);
  add_config(app, context);
  add_export(app, context);
#ifdef SPARTAN_HAS_VIEWER
  add_view(app, context);
#endif
  add_simulate(app, context);
  add_completion(app, context);
}

int run(int argc, char** argv) {
  CLI::App app{"Stereo vision for rovers: visual odometry, dense stereo, terrain maps and localization.", "spartan"};
  app.set_version_flag("--version", version_text());
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done; 1 internal fault; 2 the command line is wrong; 3 the input is missing or unusable; 4 a "
      "calibration or option file is invalid, or an option names one that is missing;\n"
      "5 the output exists or cannot be written, or memory or file descriptors ran out; 6 done, but the rover was lost "
      "for part of the drive; 7 a bad calibration "
      "(`rig inspect --check`); 130 interrupted.");
  Context context;
  context.threads = available_cores();
  context.command_line = command_line(argc, argv);
  add_commands(app, context);
  refuse_empty_arguments(app);
  const std::vector<std::string> words = words_of(argc, argv);
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));  // CLI11 takes them from the end
  } catch (const CLI::ParseError& e) {
    if (const std::string message = unknown_word(app, words); !message.empty()) {
      std::cerr << message;
      return kUsage;
    }
    if (lacks_command(app) && dynamic_cast<const CLI::RequiredError*>(&e) != nullptr) {
      std::cout << app.help();
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
    std::cout << app.help();
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
  const ExitCode code = exit_code(result.error().code);
  // An interrupted run has printed its summary.
  if (context.json && code != kInterrupted) {
    std::cout << text_of(Json{{"schema", 1}, {"error", {{"exit_code", code}, {"message", result.error().message()}}}})
              << '\n';
  }
  return code;
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

// Images are returned to the system when they are freed. glibc would keep them in the heaps of the threads (its
// threshold grows to 32 MB), which raises the peak of a run with maps by a tenth; the page faults cost 2 % of its time.
void return_freed_images() {
  constexpr int kThreshold_bytes = 4 << 20;
  mallopt(M_MMAP_THRESHOLD, kThreshold_bytes);
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
  spartan::program::return_freed_images();
  try {
    return spartan::program::run(argc, argv);
  } catch (const std::exception& e) {
    return spartan::program::exit_code_of(e);
  }
}
