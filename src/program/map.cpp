// spartan map: terrain maps of one position, and global maps on the disk.
#include "program/map.h"

#include "program/verbs.h"

namespace spartan::program {

void add_map(CLI::App& app, Context& context) {
  CLI::App* map = app.add_subcommand("map", "Terrain maps");
  map->require_subcommand(1);
  add_map_build(*map, context);
  add_map_info(*map, context);
  add_map_merge(*map, context);
  add_map_export(*map, context);
}

}  // namespace spartan::program
