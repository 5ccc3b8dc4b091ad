// Runs the program `spartan` as a user would.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace spartan::testing {

struct ProgramResult {
  int exit_code = -1;  ///< −1: ended by a signal
  int signal = 0;
  std::string out, err;
};

struct ProgramLimits {
  std::optional<std::uint64_t> largest_file_bytes;      ///< RLIMIT_FSIZE: as a full disk
  std::optional<std::chrono::milliseconds> kill_after;  ///< SIGKILL
  std::optional<std::string> interrupt_once_there;      ///< SIGINT as soon as this file has appeared
};

/// The program of this build (environment variable SPARTAN_PROGRAM).
ProgramResult run_program(const std::vector<std::string>& arguments, const ProgramLimits& limits = {});

/// The same through a shell, with `script` as its command: "$0" is the program and "$@" the arguments.
ProgramResult run_in_shell(const std::string& script, const std::vector<std::string>& arguments);

/// What make_small_runs has made once for all tests; not to be written to.
///   drive, drive_run: write_small_drive() and its run with kSmallDriveOptions and two threads
///   stops: a simulated drive with two stops (small.yaml, small_rig.yaml, rec) and its run (whole) with two threads;
///          without rec if built without Embree
std::string small_runs_folder();

}  // namespace spartan::testing
