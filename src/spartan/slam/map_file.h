// A global map in a file of its own: an SQLite database with the tile tables of a run's store.
#pragma once

#include <memory>
#include <string>

#include "spartan/core/database.h"
#include "spartan/slam/global_map.h"
#include "spartan/slam/tile_store.h"

namespace spartan {

/// An open map file and its map, whose tiles are read from it on demand.
class MapFile {
 public:
  /// Writes the whole map under a temporary name and renames it; an existing file is replaced. Code `output`.
  static Status save(GlobalMap& map, const std::string& path);
  /// Codes: `input` (missing, damaged, not a map), `configuration` (of a newer version of the program). Files of older
  /// versions are migrated first; opened read-only, they are rejected with code `configuration`.
  static Result<MapFile> open(const std::string& path, const GlobalMapOptions& options, Database::Mode mode);

  GlobalMap& map() { return *map_; }
  /// Writes all changes in one transaction.
  Status commit();

 private:
  explicit MapFile(std::unique_ptr<Database> db, std::unique_ptr<TileStore> store, std::unique_ptr<GlobalMap> map)
      : db_(std::move(db)), store_(std::move(store)), map_(std::move(map)) {}
  std::unique_ptr<Database> db_;
  std::unique_ptr<TileStore> store_;
  std::unique_ptr<GlobalMap> map_;
};

}  // namespace spartan
