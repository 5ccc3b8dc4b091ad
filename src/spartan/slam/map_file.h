// A global map in a file of its own: SQLite with the tile tables of the run's store.
#pragma once

#include <memory>
#include <string>

#include "spartan/core/database.h"
#include "spartan/slam/global_map.h"
#include "spartan/slam/tile_store.h"

namespace spartan {

/// An open map file, and the map in it, paged from it.
class MapFile {
 public:
  /// Writes the whole map under a temporary name and renames it; an existing file is replaced. Code `output`.
  static Status save(GlobalMap& map, const std::string& path);
  /// Codes: `input` (missing, damaged, not a map), `configuration` (newer than this program). Files of older versions
  /// are brought up to date first, unless they are opened to be read only: then those are refused.
  static Result<MapFile> open(const std::string& path, const GlobalMapOptions& options, Database::Mode mode);

  GlobalMap& map() { return *map_; }
  /// One transaction with everything that has changed.
  Status commit();

 private:
  explicit MapFile(std::unique_ptr<Database> db, std::unique_ptr<TileStore> store, std::unique_ptr<GlobalMap> map)
      : db_(std::move(db)), store_(std::move(store)), map_(std::move(map)) {}
  std::unique_ptr<Database> db_;
  std::unique_ptr<TileStore> store_;
  std::unique_ptr<GlobalMap> map_;
};

}  // namespace spartan
