// Writes the results of a run to its folder, on a thread of its own.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/core/stage_clock.h"
#include "spartan/storage/database.h"
#include "spartan/system/pipeline.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_options.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {

/// What a run has computed with one frame, or at its end.
struct RunResult {
  RunStore::Step step;
  std::optional<TerrainView> terrain;  ///< its files are written and its record is added to the step
  std::optional<MappedStop> stop;      ///< as terrain
  bool x_is_east = false;              ///< of the world
  bool commit_now = false;             ///< do not wait for CommitOptions::every_s
  /// The state after this result, if the run can be resumed from here.
  std::optional<RunStore::Checkpoint> checkpoint;
  MapChanges maps;  ///< with a checkpoint
  /// Whether what the checkpoint refers to is on disk; asked until it is. Empty: it is.
  std::function<bool()> can_commit_checkpoint{};
};

/// Results that wait for the disk, and what became of them.
struct RecorderStatistics {
  std::vector<StageTime> commits;    ///< of each transaction
  std::int64_t files_discarded = 0;  ///< terrain views and local maps whose files were not written (Pace::live)
};

/// Results are committed in their order, many in one transaction (CommitOptions). Those after a checkpoint that has to
/// wait do not wait for it.
///
/// Pace::recorded: add() waits where too many results wait for the disk, and an error of the disk ends the run.
/// Pace::live: add() never waits; files of terrain views and maps are then not written. Where the disk cannot be
/// written to, as a full one, results wait in memory, their commit is tried again each kRetry, and the rover goes on;
/// only where kMostUncommitted wait is it an error.
class RunRecorder {
 public:
  /// What becomes of each map: whether its files are written, when they are. Called by any thread.
  using MapReport = std::function<void(const MappedStop&, bool has_files)>;
  /// Opens a second connection to the store, for reading map tiles. Codes: `output`, `store_damaged`, `resources`.
  static Result<std::unique_ptr<RunRecorder>> create(RunStore store, RunFolder folder, const RunOptions& options,
                                                     Pace pace);
  /// Results that were not committed are lost.
  ~RunRecorder();
  RunRecorder(const RunRecorder&) = delete;
  RunRecorder& operator=(const RunRecorder&) = delete;

  /// Before the first add().
  void report_maps_to(MapReport report) { map_report_ = std::move(report); }
  /// An error is that of an earlier result; no result after it is written. Codes: `output`, `resources`.
  Status add(RunResult result);
  /// Returns when all results are committed. Codes as add(): an error of the disk now.
  Status flush();
  /// Why results cannot be committed now, and are tried again.
  std::optional<Error> disk_error() const;
  /// Whether a checkpoint was added and is not committed yet. Another one would only keep a slow disk busy.
  bool checkpoint_waits() const;
  /// Number of the latest changes of the map that are committed.
  std::uint64_t maps_stored() const;

  /// For reading tiles while the recorder writes.
  TileStore& tiles() { return tiles_; }
  /// Before the first add(), and after flush() until the next.
  RunStore& store() { return store_; }
  RecorderStatistics statistics() const;
  /// What its thread does now.
  const RunningStage& running() const { return running_; }
  /// What a checkpoint waits for.
  const RunningStage& waiting_for() const { return waiting_for_; }

  static constexpr std::size_t kMostFiles = 8;             ///< terrain views and maps that may wait
  static constexpr std::size_t kMostResults = 512;         ///< results that may wait (Pace::recorded)
  static constexpr std::size_t kMostUncommitted = 18'000;  ///< results in memory (Pace::live): half an hour at 10 Hz
  static constexpr std::chrono::seconds kRetry{2};

 private:
  using Lock = std::unique_lock<std::mutex>;
  using Clock = std::chrono::steady_clock;
  // What is to be committed together.
  struct Transaction {
    std::vector<RunStore::Step> steps;
    std::optional<RunStore::Checkpoint> checkpoint;
    MapChanges maps;
  };
  // A checkpoint whose steps are committed before it.
  struct HeldCheckpoint {
    RunStore::Checkpoint checkpoint;
    MapChanges maps;
    std::function<bool()> can_commit;
  };
  RunRecorder(RunStore store, std::unique_ptr<Database> db, TileStore tiles, RunFolder folder,
              const RunOptions& options, Pace pace);
  void run();
  Status process(RunResult result);
  Status write_files(RunResult& result);
  void discard_files(RunResult& result) const;
  void hold(RunResult& result);
  Status commit_held(bool wait);
  Status commit(std::optional<RunStore::Checkpoint> checkpoint, MapChanges maps);
  Status commit_transactions();
  bool may_wait_for_disk(const Status& status) const;
  void note_disk(const Status& status);
  Clock::time_point due_time() const;
  Clock::time_point commit_time() const;
  bool is_ended() const;
  static std::size_t files_of(const RunResult& result) { return (result.terrain ? 1U : 0U) + (result.stop ? 1U : 0U); }

  RunStore store_;
  std::unique_ptr<Database> db_;
  TileStore tiles_;
  RunFolder folder_;
  TerrainOptions terrain_options_;
  CommitOptions options_;
  Pace pace_;
  MapReport map_report_;

  // Of the thread, and read by flush() while it is not busy.
  std::deque<Transaction> transactions_;  // more than one where the disk cannot be written to
  std::size_t uncommitted_ = 0;           // steps in them
  Clock::time_point retry_;
  std::vector<RunStore::Step> batch_;
  Clock::time_point oldest_;  // of the batch
  std::optional<HeldCheckpoint> held_;
  RunStore::RowCounts rows_;  // with all transactions and the batch

  RunningStage running_, waiting_for_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<RunResult> waiting_;
  std::size_t files_waiting_ = 0;
  bool busy_ = false, flushing_ = false, ended_ = false;
  Status status_;
  std::optional<Error> disk_error_;
  std::uint64_t maps_stored_ = 0;
  std::int64_t checkpoints_waiting_ = 0;
  RecorderStatistics statistics_;
  std::thread thread_;
};

}  // namespace spartan::internal
