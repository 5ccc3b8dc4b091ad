#include <fmt/format.h>

#include <filesystem>
#include <vector>

#include "spartan/core/files.h"
#include "spartan/slam/global_map.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;

constexpr int kApplicationId = 0x53504D50;  // "SPMP"

// Version 1 is the schema of TileStore; each later version adds its migration here.
const std::vector<MapMigration>& steps() {
  static const std::vector<MapMigration> list{{1, "SELECT 1"}};
  return list;
}

Result<int> pragma(Database& db, const char* name) {
  auto statement = db.prepare(fmt::format("PRAGMA {}", name));
  if (!statement) return failure(statement);
  const auto row = statement->step();
  if (!row) return failure(row);
  return static_cast<int>(statement->integer(0));
}

Status write(GlobalMap& map, const std::string& path) {
  auto db = Database::open(path, Database::Mode::create);
  if (!db) return failure(db);
  if (Status s = db->execute(fmt::format("PRAGMA application_id = {}; BEGIN IMMEDIATE;", kApplicationId)); !s) return s;
  auto store = TileStore::open(*db);
  if (!store) return failure(store);
  if (Status s = map.copy_to(*store); !s) return s;
  // The rollback journal leaves a single file without a write-ahead log, so that it can be renamed and copied.
  return db->execute(fmt::format("PRAGMA user_version = {}; COMMIT; PRAGMA journal_mode = DELETE;", steps().back().to));
}

}  // namespace

Status MapFile::save(GlobalMap& map, const std::string& path) {
  const std::string temporary = temporary_name(path);
  std::error_code ignored;
  fs::remove(temporary, ignored);
  Status status = write(map, temporary);
  if (status) return publish_file(temporary, path);
  fs::remove(temporary, ignored);
  return status;
}

Result<MapFile> MapFile::open(const std::string& path, const GlobalMapOptions& options, Database::Mode mode) {
  auto opened = Database::open(path, mode);
  if (!opened) return failure(opened);
  auto db = std::make_unique<Database>(std::move(*opened));
  const auto id = pragma(*db, "application_id");
  if (!id) return failure(id);
  if (*id != kApplicationId) return failure(ErrorCode::input, "is not a map file of this program", path);
  const auto version = pragma(*db, "user_version");
  if (!version) return failure(version);
  if (mode == Database::Mode::read_only && *version < steps().back().to) {
    return failure(ErrorCode::configuration,
                   fmt::format("has map format version {}, older than {}", *version, steps().back().to), path,
                   "run again into a new folder to rebuild the map");
  }
  if (Status s = migrate(*db, steps()); !s) return failure(s);
  auto store = TileStore::open_existing(*db);
  if (!store) return failure(store);
  auto owned = std::make_unique<TileStore>(std::move(*store));
  const auto cell = owned->property("cell_m");
  if (!cell) return failure(cell);
  const double cell_m = cell->value_or(0.05);
  if (!(cell_m > 0)) {
    return failure(ErrorCode::store_damaged, fmt::format("is damaged: the cell size is {} m", cell_m), path,
                   "run again into a new folder to rebuild the map");
  }
  auto map = GlobalMap::from_store(options, cell_m, *owned);
  if (!map) {
    Error error = map.error();
    if (error.where.empty()) error.where = path;
    return tl::unexpected(std::move(error));
  }
  return MapFile(std::move(db), std::move(owned), std::make_unique<GlobalMap>(std::move(*map)));
}

Status MapFile::commit() {
  if (Status s = db_->execute("BEGIN IMMEDIATE"); !s) return s;
  Status status = map_->flush();
  if (!status) {
    static_cast<void>(db_->execute("ROLLBACK"));
    return status;
  }
  return db_->execute("COMMIT");
}

}  // namespace spartan
