// What all commands share: the log, the common flags, the exit codes.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "spartan/core/log.h"
#include "spartan/core/result.h"

namespace spartan::program {

/// docs/reference/command_line.md.
enum ExitCode : int {
  kDone = 0,
  kInternalFault = 1,
  kUsage = 2,
  kInput = 3,
  kConfiguration = 4,
  kOutput = 5,
  kLost = 6,            ///< finished, but the rover was lost for part of the drive
  kBadCalibration = 7,  ///< `rig inspect --check`: the images show that the calibration is bad
  kInterrupted = 130,
};
ExitCode exit_code(ErrorCode code);

/// The body of a command, called after its options were parsed. Returns an exit code (kDone, kLost), or an error that
/// main prints.
using CommandBody = std::function<Result<ExitCode>()>;

struct Context {
  Log log;               ///< ready when a CommandBody runs
  double memory_mb = 0;  ///< `--memory`; 0: 80 % of what is available
  int threads = 1;       ///< `--threads`; all cores without it
  bool json = false;     ///< `--json`: only JSON goes to standard output
  bool force = false;    ///< `--force`: output that exists is replaced
  bool quiet = false, verbose = false;
  std::string command_line;           ///< as a shell takes it
  CommandBody chosen;                 ///< body of the selected command
  std::vector<std::string> warnings;  ///< printed before the body runs: former names of flags
};

/// Adds a command with `-q` and `-v`. `example` is shown at the end of its help; it starts after the word `spartan`.
CLI::App* add_command(CLI::App& app, Context& context, const std::string& name, const std::string& summary,
                      const std::string& example, CommandBody body);
/// `--json`, for commands that have it.
void add_json_flag(CLI::App& command, Context& context);
/// `--force`, for commands that write files or folders.
CLI::Option* add_force_flag(CLI::App& command, Context& context);
/// Code `output` if the file exists and `--force` is not given, or if it is a folder. An empty path is none.
Status expect_new_file(const Context& context, const std::string& path);
/// Code `output` if the folder holds anything and `--force` is not given, or if it is a file. An empty path is none.
Status expect_new_folder(const Context& context, const std::string& path);
/// `--threads N`, for commands that have it.
void add_threads_option(CLI::App& command, Context& context);

/// Checks of numeric options.
CLI::Validator positive_number();
CLI::Validator non_negative_number();

/// Accepts the former name of an option for one version, with a warning; help does not show it.
template <class T>
CLI::Option* add_former_name(CLI::App& command, Context& context, const std::string& former, const std::string& name,
                             T& value) {
  const auto warn = [&context, former, name](const std::string&) {
    context.warnings.push_back(former + " is now called " + name +
                               "; the former name is accepted for this version only");
  };
  return command.add_option(former, value)->group("")->each(warn);
}

/// `--memory`, for commands that compute disparity images.
void add_memory_option(CLI::App& command, Context& context);
/// The bound that it sets, bytes; without it 80 % of the memory that is available.
std::int64_t memory_bound(const Context& context);

/// "2026-03-01 12:30 UTC"
std::string date_and_time();

/// Writes to standard output and flushes; code `output` where that fails (a full disk behind a pipe).
Status print(const std::string& text);

}  // namespace spartan::program
