// spartan map: terrain maps of one stop, and saved global maps.
#include "program/map.h"

#include "program/commands.h"

namespace spartan::program {

void add_map(CLI::App& app, Context& context) {
  CLI::App* map = app.add_subcommand("map", "Build, inspect, merge and export terrain maps");
  map->require_subcommand(1);
  add_map_build(*map, context);
  add_map_info(*map, context);
  add_map_merge(*map, context);
  add_map_export(*map, context);
}

}  // namespace spartan::program
