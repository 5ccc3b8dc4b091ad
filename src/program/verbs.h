// The verbs of the program. A further verb is one file with one `add_…` function, declared here and called in main.
#pragma once

#include <CLI/CLI.hpp>

#include "program/context.h"

namespace spartan::program {

void add_demo(CLI::App& app, Context& context);
void add_stereo(CLI::App& app, Context& context);
void add_run(CLI::App& app, Context& context);
void add_rig(CLI::App& app, Context& context);
void add_config(CLI::App& app, Context& context);
void add_export(CLI::App& app, Context& context);
void add_map(CLI::App& app, Context& context);
void add_evaluate(CLI::App& app, Context& context);
void add_simulate(CLI::App& app, Context& context);

}  // namespace spartan::program
