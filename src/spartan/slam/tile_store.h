// Persistent storage of the global map: tables of tiles, submaps and stops, in a run's store or in a map file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "spartan/core/database.h"
#include "spartan/slam/submap.h"

namespace spartan {

/// Writes take part in the current transaction of the database; its owner commits. Tables (all `map_…`):
/// map_tiles (submap, ix, iy, revision → checksum, cells), map_submaps (id → anchor), map_stops (id → stamp, pose,
/// covariance), map_properties (key → value). Only the newest revision of a tile is kept.
class TileStore {
 public:
  /// Opens the tables and creates missing ones. Borrows the database.
  static Result<TileStore> open(Database& db);
  /// Opens existing tables of a database that may be read-only.
  static Result<TileStore> open_existing(Database& db);

  struct Entry {
    TileKey key;
    std::int64_t revision = 0;
  };
  /// All tiles in the order of their keys, with their newest revisions.
  Result<std::vector<Entry>> index();
  Status write(const Entry& entry, const Tile& tile);
  /// Code `store_damaged`, naming file and tile, where the tile is missing or its checksum is wrong.
  Result<Tile> read(const Entry& entry);

  Status write(const Submap& submap);
  Result<std::vector<Submap>> submaps();
  Status write(const MapStop& stop);
  Result<std::vector<MapStop>> stops();
  Status write_property(const std::string& key, double value);
  Result<std::optional<double>> property(const std::string& key);

 private:
  explicit TileStore(Database& db) : db_(&db) {}
  Status prepare();
  Database* db_;
  std::optional<SqlStatement> insert_tile_, delete_older_, select_tile_;
};

/// One step of the schema migration: from version `to` − 1 to version `to`.
struct MapMigration {
  int to = 0;
  std::string sql;
};
/// Runs the missing steps, each in a transaction of its own that also sets `user_version`. Code `configuration` where
/// the file is newer than the last step.
Status migrate(Database& db, const std::vector<MapMigration>& steps);

}  // namespace spartan
