#include "program/context.h"

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace spartan::program {

ExitCode exit_code(ErrorCode code) {
  switch (code) {
    case ErrorCode::internal:
      return kInternalFault;
    case ErrorCode::usage:
      return kUsage;
    case ErrorCode::input:
    case ErrorCode::frame_rejected:
    case ErrorCode::store_damaged:
      return kInput;
    case ErrorCode::configuration:
      return kConfiguration;
    case ErrorCode::output:
      return kOutput;
    case ErrorCode::interrupted:
      return kInterrupted;
  }
  return kInternalFault;
}

CLI::App* add_verb(CLI::App& app, Context& context, const std::string& name, const std::string& summary,
                   const std::string& example, VerbBody body) {
  CLI::App* verb = app.add_subcommand(name, summary);
  verb->footer("Example:\n  spartan " + example);
  auto* quiet = verb->add_flag("-q,--quiet", context.quiet, "say only what went wrong");
  verb->add_flag("-v,--verbose", context.verbose, "say more")->excludes(quiet);
  verb->callback([&context, body = std::move(body)] { context.chosen = body; });
  return verb;
}

void add_json_flag(CLI::App& verb, Context& context) {
  verb.add_flag("--json", context.json, "print JSON, and nothing else, to standard output");
}

void add_threads_option(CLI::App& verb, Context& context) {
  verb.add_option("--threads", context.threads, "how many threads may work (default: one per core)")
      ->check(CLI::Range(1, 1024));
}

Status print(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    return failure(ErrorCode::output, std::string("cannot be written: ") + std::strerror(errno), "standard output");
  }
  return {};
}

}  // namespace spartan::program
