#include "spartan/slam/tile_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace spartan {
namespace {

constexpr const char* kSchema = R"(
CREATE TABLE IF NOT EXISTS map_tiles (
  submap INTEGER NOT NULL, ix INTEGER NOT NULL, iy INTEGER NOT NULL, revision INTEGER NOT NULL,
  checksum INTEGER NOT NULL, cells BLOB NOT NULL, PRIMARY KEY (submap, ix, iy, revision)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS map_submaps (id INTEGER PRIMARY KEY, anchor BLOB NOT NULL);
CREATE TABLE IF NOT EXISTS map_stops (id INTEGER PRIMARY KEY, stamp_ns INTEGER NOT NULL, pose BLOB NOT NULL, covariance BLOB NOT NULL);
CREATE TABLE IF NOT EXISTS map_properties (key TEXT PRIMARY KEY, value REAL NOT NULL) WITHOUT ROWID;
)";

Bytes bytes_of(const Pose& pose) {
  ArchiveWriter out;
  out.put(pose);
  return out.take();
}
Bytes bytes_of(const Matrix6d& matrix) {
  ArchiveWriter out;
  out.put(matrix);
  return out.take();
}

// FNV-1a hash (Fowler, Noll, Vo) of key and bytes, so that a tile under a wrong key is detected as well.
std::int64_t checksum_of(const TileStore::Entry& entry, const Bytes& bytes) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  const auto add = [&](const void* data, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) {
      hash ^= static_cast<const std::uint8_t*>(data)[i];
      hash *= 0x100000001b3U;
    }
  };
  add(&entry.key.submap, sizeof entry.key.submap);
  add(&entry.key.x, sizeof entry.key.x);
  add(&entry.key.y, sizeof entry.key.y);
  add(&entry.revision, sizeof entry.revision);
  add(bytes.data(), bytes.size());
  return static_cast<std::int64_t>(hash);
}

std::string name_of(const TileStore::Entry& e) {
  return fmt::format("tile {}, {} of submap {}, revision {}", e.key.x, e.key.y, e.key.submap, e.revision);
}

// Bounds of what a map may contain, far beyond what a rover drives: products of these with the side of a tile fit an
// int.
constexpr std::int64_t kMostSubmaps = 1'000'000'000, kFarthestTile = 1'000'000;

tl::unexpected<Error> damaged_map(const std::string& path, const std::string& what) {
  return failure(ErrorCode::store_damaged, "is damaged: " + what, path,
                 "run again into a new folder to rebuild the map");
}

// An id of a submap or a stop.
Result<std::int32_t> id_in(const SqlStatement& row, int column, const std::string& path, const char* table) {
  const std::int64_t id = row.integer(column);
  if (id < 0 || id > kMostSubmaps) return damaged_map(path, fmt::format("table '{}' has the id {}", table, id));
  return static_cast<std::int32_t>(id);
}

}  // namespace

Result<TileStore> TileStore::open(Database& db) {
  if (Status s = db.execute(kSchema); !s) return failure(s);
  return open_existing(db);
}

Result<TileStore> TileStore::open_existing(Database& db) {
  if (Status s = db.expect_tables(kSchema); !s) return failure(s);
  TileStore store(db);
  if (Status s = store.prepare(); !s) return failure(s);
  return store;
}

Status TileStore::prepare() {
  const auto make = [&](std::optional<SqlStatement>& statement, const char* sql) -> Status {
    auto prepared = db_->prepare(sql);
    if (!prepared) return failure(prepared);
    statement.emplace(std::move(*prepared));
    return {};
  };
  if (Status s = make(insert_tile_, "INSERT OR REPLACE INTO map_tiles VALUES (?,?,?,?,?,?)"); !s) return s;
  if (Status s = make(delete_older_, "DELETE FROM map_tiles WHERE submap = ? AND ix = ? AND iy = ? AND revision < ?");
      !s)
    return s;
  return make(select_tile_,
              "SELECT checksum, cells FROM map_tiles WHERE submap = ? AND ix = ? AND iy = ? AND revision = ?");
}

Result<std::vector<TileStore::Entry>> TileStore::index() {
  std::vector<Entry> entries;
  const Status status = for_each_row(
      *db_, "SELECT submap, ix, iy, max(revision) FROM map_tiles GROUP BY submap, ix, iy ORDER BY submap, ix, iy",
      [&](const SqlStatement& row) -> Status {
        const auto submap = id_in(row, 0, db_->path(), "map_tiles");
        if (!submap) return failure(submap);
        const std::int64_t x = row.integer(1), y = row.integer(2), revision = row.integer(3);
        if (std::min(x, y) < -kFarthestTile || std::max(x, y) > kFarthestTile || revision < 1 ||
            revision > std::numeric_limits<std::int64_t>::max() / 2) {
          return damaged_map(db_->path(), fmt::format("table 'map_tiles' has tile {}, {} of submap {}, revision {}", x,
                                                      y, *submap, revision));
        }
        entries.push_back({{*submap, static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)}, revision});
        return {};
      });
  if (!status) return failure(status);
  return entries;
}

Status TileStore::write(const Entry& e, const Tile& tile) {
  const Bytes bytes = to_bytes(tile);
  const auto key = [&](SqlStatement& s) -> SqlStatement& {
    return s.bind(1, std::int64_t{e.key.submap})
        .bind(2, std::int64_t{e.key.x})
        .bind(3, std::int64_t{e.key.y})
        .bind(4, e.revision);
  };
  if (Status s = key(*insert_tile_).bind(5, checksum_of(e, bytes)).bind(6, bytes).run(); !s) return s;
  return key(*delete_older_).run();
}

Result<Tile> TileStore::read(const Entry& e) {
  SqlStatement& select = *select_tile_;
  select.bind(1, std::int64_t{e.key.submap}).bind(2, std::int64_t{e.key.x}).bind(3, std::int64_t{e.key.y});
  const auto row = select.bind(4, e.revision).step();
  if (!row || !*row) {
    select.reset();
    if (!row) return failure(row);
    return failure(ErrorCode::store_damaged, name_of(e) + " is missing", db_->path(),
                   "run again into a new folder to rebuild the map");
  }
  const std::int64_t checksum = select.integer(0);
  const Bytes bytes = select.blob(1);
  select.reset();
  if (checksum != checksum_of(e, bytes)) {
    return failure(ErrorCode::store_damaged, name_of(e) + " is damaged: checksum mismatch", db_->path(),
                   "run again into a new folder to rebuild the map");
  }
  return tile_from_bytes(bytes, db_->path() + ": " + name_of(e));
}

Status TileStore::write(const Submap& submap) {
  auto insert = db_->prepare("INSERT OR REPLACE INTO map_submaps VALUES (?,?)");
  if (!insert) return failure(insert);
  return insert->bind(1, std::int64_t{submap.id}).bind(2, bytes_of(submap.world_from_submap)).run();
}

Result<std::vector<Submap>> TileStore::submaps() {
  std::vector<Submap> submaps;
  const Status status =
      for_each_row(*db_, "SELECT id, anchor FROM map_submaps ORDER BY id", [&](const SqlStatement& row) -> Status {
        const auto id = id_in(row, 0, db_->path(), "map_submaps");
        if (!id) return failure(id);
        const Bytes bytes = row.blob(1);
        ArchiveReader in(bytes);
        submaps.push_back({*id, in.get_pose()});
        return in.finish(fmt::format("{}: submap {}", db_->path(), *id));
      });
  if (!status) return failure(status);
  return submaps;
}

Status TileStore::write(const MapStop& stop) {
  auto insert = db_->prepare("INSERT OR REPLACE INTO map_stops VALUES (?,?,?,?)");
  if (!insert) return failure(insert);
  insert->bind(1, std::int64_t{stop.id}).bind(2, stop.stamp.ns).bind(3, bytes_of(stop.world_from_body.pose));
  return insert->bind(4, bytes_of(stop.world_from_body.covariance)).run();
}

Result<std::vector<MapStop>> TileStore::stops() {
  std::vector<MapStop> stops;
  const Status status = for_each_row(*db_, "SELECT id, stamp_ns, pose, covariance FROM map_stops ORDER BY id",
                                     [&](const SqlStatement& row) -> Status {
                                       const Bytes pose = row.blob(2), covariance = row.blob(3);
                                       const auto id = id_in(row, 0, db_->path(), "map_stops");
                                       if (!id) return failure(id);
                                       ArchiveReader in(pose), more(covariance);
                                       stops.push_back({*id, {row.integer(1)}, {in.get_pose(), more.get_matrix6()}});
                                       const std::string what = fmt::format("{}: stop {}", db_->path(), *id);
                                       if (Status s = in.finish(what); !s) return s;
                                       return more.finish(what);
                                     });
  if (!status) return failure(status);
  return stops;
}

Status TileStore::write_property(const std::string& key, double value) {
  auto insert = db_->prepare("INSERT OR REPLACE INTO map_properties VALUES (?,?)");
  if (!insert) return failure(insert);
  return insert->bind(1, key).bind(2, value).run();
}

Status TileStore::write(const MapChanges& changes) {
  if (changes.cell_m) {
    if (Status s = write_property("cell_m", *changes.cell_m); !s) return s;
  }
  for (const Submap& submap : changes.submaps) {
    if (Status s = write(submap); !s) return s;
  }
  for (const MapStop& stop : changes.stops) {
    if (Status s = write(stop); !s) return s;
  }
  for (const auto& [entry, tile] : changes.tiles) {
    if (Status s = write(entry, tile); !s) return s;
  }
  return {};
}

Result<std::optional<double>> TileStore::property(const std::string& key) {
  auto select = db_->prepare("SELECT value FROM map_properties WHERE key = ?");
  if (!select) return failure(select);
  const auto row = select->bind(1, key).step();
  if (!row) return failure(row);
  return *row ? std::optional<double>(select->real(0)) : std::nullopt;
}

Status migrate(Database& db, const std::vector<MapMigration>& steps) {
  int version = 0;
  if (Status s = for_each_row(db, "PRAGMA user_version",
                              [&](const SqlStatement& row) -> Status {
                                version = static_cast<int>(row.integer(0));
                                return {};
                              });
      !s)
    return s;
  if (const int newest = steps.empty() ? 0 : steps.back().to; version > newest) {
    return failure(ErrorCode::configuration,
                   fmt::format("has version {}, this program supports up to version {}", version, newest), db.path(),
                   "use a newer program");
  }
  for (const MapMigration& step : steps) {
    if (step.to <= version) continue;
    // Executed as one text: a failure leaves the transaction open, and it is rolled back.
    Status status =
        db.execute(fmt::format("BEGIN IMMEDIATE; {}; PRAGMA user_version = {}; COMMIT;", step.sql, step.to));
    if (!status) {
      static_cast<void>(db.execute("ROLLBACK"));
      return status;
    }
  }
  return {};
}

}  // namespace spartan
