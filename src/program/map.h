// The commands under `spartan map`.
#pragma once

#include <CLI/CLI.hpp>

#include "program/context.h"

namespace spartan::program {

void add_map_build(CLI::App& map, Context& context);
void add_map_info(CLI::App& map, Context& context);
void add_map_merge(CLI::App& map, Context& context);
void add_map_export(CLI::App& map, Context& context);

}  // namespace spartan::program
