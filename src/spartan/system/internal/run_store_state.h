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
      insert_innovation, insert_latency, insert_inputs, insert_smoothed, insert_terrain, insert_map, select_progress,
      replace_checkpoint, replace_content, replace_elapsed, replace_counts, replace_stream, select_counts;
  /// How far the stored run has come.
  struct Progress {
    std::int64_t frames = 0, samples_taken = 0;  ///< committed frames; samples at the latest checkpoint, −1: none
    bool operator==(const Progress&) const = default;
  };
  Progress progress;  ///< as this process wrote it last

  Status prepare();
  /// Removes the records after the latest checkpoint.
  Status return_to_checkpoint();
  Result<Progress> stored_progress();
  Result<RowCounts> row_counts();
  /// Code `output` if the database is no longer the one that this process wrote last.
  Status expect_unchanged();
  /// Calls write() in a transaction.
  Status commit(const std::function<Status()>& write);
  Status write(const Step& step);
  Status write_checkpoint(const Checkpoint& checkpoint);
  Status write(const FrameRecord& frame);
  Status write(const LocalizationRecord& localization);
  Status write(const TerrainRecord& terrain);
  Status write(const MapRecord& map);
  Status write(const std::vector<StageTime>& times);
};

/// Appends the Hash64 of the bytes to them: stage memory is not parsed unless it is as it was written.
void append_checksum(Bytes& bytes);
/// Removes the checksum; false if it does not fit.
bool remove_checksum(Bytes& bytes);

}  // namespace spartan
