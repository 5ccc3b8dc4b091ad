// What all verbs share: where messages go, the common flags, exit codes.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "spartan/core/log.h"
#include "spartan/core/result.h"

namespace spartan::program {

/// docs/formats.md, "Exit codes".
enum ExitCode : int {
  kDone = 0,
  kInternalFault = 1,
  kUsage = 2,
  kInput = 3,
  kConfiguration = 4,
  kOutput = 5,
  kLost = 6,  ///< finished, but the rover was lost for part of the drive
  kInterrupted = 130,
};
ExitCode exit_code(ErrorCode code);

/// What a verb does once its options are read: an exit code (kDone, kLost), or an error that main prints.
using VerbBody = std::function<Result<ExitCode>()>;

struct Context {
  Log log;            ///< ready when a VerbBody runs
  int threads = 1;    ///< `--threads`; all cores without it
  bool json = false;  ///< `--json`: only JSON goes to standard output
  bool quiet = false, verbose = false;
  VerbBody chosen;  ///< the body of the verb that was given
};

/// Adds a verb with `-q` and `-v`. `example` is shown at the end of its help, without the word `spartan`.
CLI::App* add_verb(CLI::App& app, Context& context, const std::string& name, const std::string& summary,
                   const std::string& example, VerbBody body);
/// `--json`, for verbs that have it.
void add_json_flag(CLI::App& verb, Context& context);
/// `--threads N`, for verbs that have it.
void add_threads_option(CLI::App& verb, Context& context);

/// Writes to standard output and flushes; code `output` where that fails (a full disk behind a pipe).
Status print(const std::string& text);

}  // namespace spartan::program
