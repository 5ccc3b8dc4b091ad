// The commands of the program. To add one, write one file with one `add_…` function, declare it here, call it in main.
#pragma once

#include <CLI/CLI.hpp>

#include "program/context.h"

namespace spartan::program {

void add_completion(CLI::App& app, Context& context);
void add_demo(CLI::App& app, Context& context);
void add_stereo(CLI::App& app, Context& context);
void add_run(CLI::App& app, Context& context);
void add_record(CLI::App& app, Context& context);
void add_rig(CLI::App& app, Context& context);
void add_config(CLI::App& app, Context& context);
void add_export(CLI::App& app, Context& context);
void add_view(CLI::App& app, Context& context);
void add_map(CLI::App& app, Context& context);
void add_features(CLI::App& app, Context& context);
void add_evaluate(CLI::App& app, Context& context);
void add_simulate(CLI::App& app, Context& context);

}  // namespace spartan::program
