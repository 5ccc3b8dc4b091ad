// spartan rig design.
#pragma once

#include <CLI/CLI.hpp>

#include "program/context.h"

namespace spartan::program {

void add_rig_design(CLI::App& rig, Context& context);

}  // namespace spartan::program
