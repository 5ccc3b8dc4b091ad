// The global map on the disk: tables of tiles, submaps and stops, in a run's store or in a file of their own.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "spartan/core/database.h"
#include "spartan/slam/submap.h"

namespace spartan {

/// Writes happen in whatever transaction the database is in; whoever owns it commits. Tables (all `map_…`):
/// map_tiles (submap, ix, iy, revision → checksum, cells), map_submaps (id → anchor), map_stops (id → stamp, pose,
/// covariance), map_properties (key → value). Only the newest revision of a tile is kept.
class TileStore {
 public:
  /// The tables, made where they are missing. Borrows the database.
  static Result<TileStore> open(Database& db);
  /// Tables that are there already, of a database that may be read only.
  static Result<TileStore> open_existing(Database& db);

  struct Entry {
    TileKey key;
    std::int64_t revision = 0;
  };
  /// All tiles, in order.
  Result<std::vector<Entry>> index();
  Status write(const Entry& entry, const Tile& tile);
  /// Code `store_damaged`, naming file and tile, where it is missing or its checksum does not fit.
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

/// One step of a saved map's history: what brings a file of version `to` − 1 to version `to`.
struct MapMigration {
  int to = 0;
  std::string sql;
};
/// Runs the steps that are missing, each in a transaction of its own with the new `user_version`. Code `configuration`
/// where the file is newer than the last step.
Status migrate(Database& db, const std::vector<MapMigration>& steps);

}  // namespace spartan
