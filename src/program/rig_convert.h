// `spartan rig convert`, and what the verbs of `rig` share.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "program/context.h"

namespace spartan::program {

void add_rig_convert(CLI::App& rig, Context& context);

/// Code `input` where there is no such file or folder; of "LEFT,RIGHT" both have to be there.
Status calibration_is_there(const std::string& path);

}  // namespace spartan::program
