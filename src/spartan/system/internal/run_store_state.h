// The open database of a RunStore and its prepared statements, shared by writing (run_store.cpp) and reading
// (run_store_reading.cpp).
#pragma once

#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "spartan/storage/database.h"
#include "spartan/system/run_store.h"

namespace spartan {

struct RunStore::State {
  explicit State(Database db_in) : db(std::move(db_in)) {}
  std::optional<TileStore> tiles;
  Database db;
  std::optional<SqlStatement> insert_frame, insert_time, insert_localization, insert_slam, insert_health,
      insert_terrain, insert_map, replace_checkpoint;

  Status prepare();
  Status write(const Step& step, const std::function<Result<Bytes>()>& save, std::int64_t samples_taken);
  Status write(const FrameRecord& frame);
  Status write(const LocalizationRecord& localization);
  Status write(const TerrainRecord& terrain);
  Status write(const MapRecord& map);
  Status write(const std::vector<StageTime>& times);
};

}  // namespace spartan
