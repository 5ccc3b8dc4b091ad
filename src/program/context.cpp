#include "program/context.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <functional>

#include "spartan/core/stage_clock.h"

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
    case ErrorCode::read_error:
      return kInput;
    case ErrorCode::configuration:
      return kConfiguration;
    case ErrorCode::output:
    case ErrorCode::resources:
      return kOutput;
    case ErrorCode::interrupted:
      return kInterrupted;
  }
  return kInternalFault;
}

CLI::App* add_command(CLI::App& app, Context& context, const std::string& name, const std::string& summary,
                      const std::string& example, CommandBody body) {
  CLI::App* command = app.add_subcommand(name, summary);
  std::string footer = "Example:\n  spartan " + example;
  if (example.find("$SPARTAN_DATA") != std::string::npos) footer += "\n($SPARTAN_DATA is a folder with recordings)";
  command->footer(footer);
  auto* quiet = command->add_flag("-q,--quiet", context.quiet,
                                  "Print errors and results only: no progress, information or warnings.");
  command->add_flag("-v,--verbose", context.verbose, "Print debug messages, too.")->excludes(quiet);
  command->callback([&context, body = std::move(body)] { context.chosen = body; });
  return command;
}

void add_json_flag(CLI::App& command, Context& context) {
  command.add_flag("--json", context.json,
                   "Print one JSON object to standard output and nothing else; messages go to standard error.");
}

CLI::Option* add_force_flag(CLI::App& command, Context& context) {
  return command.add_flag("--force", context.force, "Replace output that exists. Without it that is exit code 5.");
}

Status expect_new_file(const Context& context, const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error))
    return failure(ErrorCode::output, "is a folder, not a file", path, "choose another name");
  if (context.force || !std::filesystem::is_regular_file(path, error)) return {};
  return failure(ErrorCode::output, "exists already", path, "--force replaces it");
}

Status expect_new_folder(const Context& context, const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_regular_file(path, error))
    return failure(ErrorCode::output, "is a file, not a folder", path, "choose another name");
  if (context.force || !std::filesystem::is_directory(path, error) || std::filesystem::is_empty(path, error)) return {};
  return failure(ErrorCode::output, "exists already and is not empty", path, "--force replaces the files in it");
}

void add_threads_option(CLI::App& command, Context& context) {
  command
      .add_option("--threads", context.threads,
                  "Maximum number of threads (default: number of cores). Results do not depend on it.")
      ->check(CLI::Range(1, 1024));
}

void add_memory_option(CLI::App& command, Context& context) {
  command
      .add_option(
          "--memory", context.memory_mb,
          "Memory limit in MB for images and disparities (default: 80 % of what is available). Input that would "
          "exceed it is refused at the start, with exit code 5.")
      ->check(positive_number());
}

std::int64_t memory_bound(const Context& context) {
  if (context.memory_mb > 0) return static_cast<std::int64_t>(std::min(1e6 * context.memory_mb, 1e18));
  return available_memory_bytes() / 5 * 4;
}

namespace {

CLI::Validator number_check(const std::string& wanted, const std::function<bool(double)>& accepts) {
  const auto check = [wanted, accepts](const std::string& text) -> std::string {
    double value = 0;
    const bool good = CLI::detail::lexical_cast(text, value) && std::isfinite(value) && accepts(value);
    return good ? "" : "'" + text + "' is not a " + wanted;
  };
  return CLI::Validator(check, "");
}

}  // namespace

CLI::Validator positive_number() {
  return number_check("positive number", [](double value) { return value > 0; });
}

CLI::Validator non_negative_number() {
  return number_check("number of at least 0", [](double value) { return value >= 0; });
}

std::string date_and_time() {
  return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr)));
}

Status print(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    return failure(ErrorCode::output, std::string("cannot write: ") + std::strerror(errno), "standard output");
  }
  return {};
}

}  // namespace spartan::program
