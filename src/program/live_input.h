// Live streams by their address, on the command line.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "program/context.h"
#include "spartan/camera/recording.h"
#include "spartan/camera/sample_stream.h"
#include "spartan/core/result.h"

namespace spartan::program {

struct LiveArguments {
  LiveOptions options;
  std::vector<std::string> scenario_keys = {};  ///< assignments "group.key=value"
};

/// Adds --speed, --passes, --sensors and --set-scenario, and returns them.
std::vector<const CLI::Option*> add_live_options(CLI::App& command, LiveArguments& arguments);

/// Whether an input is the address of a live stream, and not a recording.
bool is_live_input(const std::string& input);

/// Opens `sim:SCENARIO` (open_simulation()), or what open_live_stream() opens. Codes: theirs, and `usage` for arguments
/// that have no meaning for this kind of stream.
Result<std::unique_ptr<SampleStream>> open_live_input(const Context& context, const std::string& address,
                                                      const OpenOptions& open, const LiveArguments& arguments);

}  // namespace spartan::program
