#include "spartan/system/internal/run_recorder.h"

#include <algorithm>
#include <ctime>
#include <utility>

#include "spartan/system/internal/terrain_files.h"
#include "spartan/system/map_files.h"

namespace spartan::internal {
namespace {

MapRecord record_of(const MappedStop& stop) {
  const LocalMap& map = stop.merged.local;
  MapRecord record;
  record.stamp = stop.stamp;
  record.position_id = stop.position_id;
  record.views = stop.views;
  record.prior = stop.prior;
  record.world_from_body = stop.merged.corrected;
  record.status = name_of(stop.merged.match.status);
  record.overlap = stop.merged.match.overlap;
  record.obstacles = static_cast<int>(map.obstacles.size());
  for (int y = 0; y < map.size().height; ++y) {
    for (int x = 0; x < map.size().width; ++x) record.known_cells += map.count(x, y) > 0 ? 1 : 0;
  }
  return record;
}

// Of a file that this run has just written.
Error as_output_error(Error error) {
  if (error.code == ErrorCode::read_error) error.code = ErrorCode::output;
  return error;
}

// How often a checkpoint that waits is tried.
constexpr std::chrono::milliseconds kAskAgain{10};

std::chrono::nanoseconds seconds(double s) {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(s * 1e9));
}

}  // namespace

Result<std::unique_ptr<RunRecorder>> RunRecorder::create(RunStore store, RunFolder folder, const RunOptions& options,
                                                         Pace pace) {
  auto db = Database::open(folder.store(), Database::Mode::open);
  if (!db) return tl::unexpected(as_output_error(db.error()));
  auto owned = std::make_unique<Database>(std::move(*db));
  auto tiles = TileStore::open_existing(*owned);
  if (!tiles) return failure(tiles);
  const auto rows = store.row_counts();
  if (!rows) return failure(rows);
  auto recorder = std::unique_ptr<RunRecorder>(
      new RunRecorder(std::move(store), std::move(owned), std::move(*tiles), std::move(folder), options, pace));
  recorder->rows_ = *rows;
  return recorder;
}

RunRecorder::RunRecorder(RunStore store, std::unique_ptr<Database> db, TileStore tiles, RunFolder folder,
                         const RunOptions& options, Pace pace)
    : store_(std::move(store)),
      db_(std::move(db)),
      tiles_(std::move(tiles)),
      folder_(std::move(folder)),
      terrain_options_(options.terrain),
      options_(options.commit),
      pace_(pace) {}

RunRecorder::~RunRecorder() {
  {
    const Lock lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

Status RunRecorder::add(RunResult result) {
  Lock lock(mutex_);
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  if (pace_ == Pace::recorded) {
    changed_.wait(lock, [this] { return !status_ || (waiting_.size() < kMostResults && files_waiting_ < kMostFiles); });
  } else if (files_waiting_ + files_of(result) > kMostFiles) {
    statistics_.files_discarded += static_cast<std::int64_t>(files_of(result));
    discard_files(result);
  }
  if (!status_) return status_;
  files_waiting_ += files_of(result);
  checkpoints_waiting_ += result.checkpoint ? 1 : 0;
  waiting_.push_back(std::move(result));
  changed_.notify_all();
  return {};
}

Status RunRecorder::flush() {
  Lock lock(mutex_);
  flushing_ = true;
  changed_.notify_all();
  if (thread_.joinable()) {
    changed_.wait(lock, [this] {
      return !status_ || (waiting_.empty() && !busy_ && batch_.empty() && transactions_.empty() && !held_);
    });
  }
  flushing_ = false;
  return status_;
}

std::optional<Error> RunRecorder::disk_error() const {
  const Lock lock(mutex_);
  return disk_error_;
}

bool RunRecorder::checkpoint_waits() const {
  const Lock lock(mutex_);
  return checkpoints_waiting_ > 0;
}

std::uint64_t RunRecorder::maps_stored() const {
  const Lock lock(mutex_);
  return maps_stored_;
}

RecorderStatistics RunRecorder::statistics() const {
  const Lock lock(mutex_);
  return statistics_;
}

RunRecorder::Clock::time_point RunRecorder::commit_time() const {
  return oldest_ + seconds(options_.every_s);
}

// When there is something to commit without another result.
RunRecorder::Clock::time_point RunRecorder::due_time() const {
  const auto never = Clock::time_point::max();
  return std::min(batch_.empty() ? never : commit_time(), transactions_.empty() ? never : retry_);
}

void RunRecorder::run() {
  Lock lock(mutex_);
  for (;;) {
    const auto has_work = [this] {
      return ended_ || !waiting_.empty() || (flushing_ && !(batch_.empty() && transactions_.empty()));
    };
    if (batch_.empty() && transactions_.empty() && !held_) {
      changed_.wait(lock, has_work);
    } else {
      const auto due = due_time();
      changed_.wait_until(lock, held_ ? std::min(due, Clock::now() + kAskAgain) : due, has_work);
    }
    if (ended_ || !status_) return;
    std::optional<RunResult> next;
    if (!waiting_.empty()) {
      next = std::move(waiting_.front());
      waiting_.pop_front();
      files_waiting_ -= files_of(*next);
    }
    busy_ = true;
    const bool flushing = flushing_;
    lock.unlock();
    Status status;
    try {
      status = commit_held(false);
      if (status && next) status = process(std::move(*next));
      if (status && !next && (flushing || Clock::now() >= due_time())) status = commit({}, {});
    } catch (const std::bad_alloc& exception) {
      status = tl::unexpected(out_of_memory(exception));
    }
    lock.lock();
    busy_ = false;
    if (!status) status_ = status;
    changed_.notify_all();
  }
}

bool RunRecorder::is_ended() const {
  const Lock lock(mutex_);
  return ended_;
}

void RunRecorder::discard_files(RunResult& result) const {
  result.terrain.reset();
  if (!result.stop) return;
  result.step.map = record_of(*result.stop);
  if (map_report_) map_report_(*result.stop, false);
  result.stop.reset();
}

Status RunRecorder::process(RunResult result) {
  if (Status written = write_files(result); !written) {
    if (!may_wait_for_disk(written)) return written;
    note_disk(written);
    {
      const Lock lock(mutex_);
      statistics_.files_discarded += static_cast<std::int64_t>(files_of(result));
    }
    discard_files(result);
  }
  if (result.stop && map_report_) map_report_(*result.stop, true);
  if (batch_.empty()) oldest_ = Clock::now();
  rows_.frames += result.step.frame ? 1 : 0;
  rows_.terrain += result.step.terrain ? 1 : 0;
  rows_.maps += result.step.map ? 1 : 0;
  batch_.push_back(std::move(result.step));
  if (result.checkpoint) {
    if (Status committed = commit_held(true); !committed || held_) return committed;
    if (!result.can_commit_checkpoint) return commit(std::move(result.checkpoint), std::move(result.maps));
    hold(result);
    if (Status committed = commit_held(false); !committed || !held_) return committed;
    return commit({}, {});  // frames do not wait for the recording
  }
  const bool due = result.commit_now || Clock::now() >= commit_time();
  return due ? commit({}, {}) : Status();
}

void RunRecorder::hold(RunResult& result) {
  held_ = {std::move(*result.checkpoint), std::move(result.maps), std::move(result.can_commit_checkpoint)};
  held_->checkpoint.rows = rows_;
  waiting_for_.begin("recording");
}

// With what comes before it. `wait`: until it can be committed.
Status RunRecorder::commit_held(bool wait) {
  if (!held_) return {};
  while (!held_->can_commit()) {
    if (!wait || is_ended()) return {};
    std::this_thread::sleep_for(kAskAgain);
  }
  waiting_for_.end(nullptr);
  HeldCheckpoint held = std::move(*std::exchange(held_, std::nullopt));
  return commit(std::move(held.checkpoint), std::move(held.maps));
}

Status RunRecorder::write_files(RunResult& result) {
  StageClock clock(CLOCK_THREAD_CPUTIME_ID);
  clock.show_in(running_);
  RunStore::Step& step = result.step;
  if (result.terrain) {
    auto written =
        clock.measure("terrain", [&] { return write_terrain(*result.terrain, terrain_options_, folder_.terrain()); });
    if (!written) return failure(written);
    step.terrain = *written;
  }
  if (result.stop) {
    const MapContext about{result.x_is_east, {{0, result.stop->stamp}}};
    Status written = clock.measure("maps", [&] {
      return write_local_map(result.stop->merged.local, about, folder_.local_map(result.stop->stamp));
    });
    if (!written) return written;
    step.map = record_of(*result.stop);
  }
  std::vector<StageTime>& times = step.frame ? step.frame->times : step.times;
  for (const StageTime& time : clock.take()) times.push_back(time);
  return {};
}

// Whether the rover goes on without it.
bool RunRecorder::may_wait_for_disk(const Status& status) const {
  const bool of_disk = status.error().code == ErrorCode::output || status.error().code == ErrorCode::resources;
  return pace_ == Pace::live && of_disk && uncommitted_ + batch_.size() < kMostUncommitted;
}

void RunRecorder::note_disk(const Status& status) {
  const Lock lock(mutex_);
  disk_error_ = status ? std::optional<Error>() : status.error();
}

Status RunRecorder::commit(std::optional<RunStore::Checkpoint> checkpoint, MapChanges maps) {
  if (!batch_.empty() || checkpoint) {
    uncommitted_ += batch_.size();
    transactions_.push_back({std::move(batch_), std::move(checkpoint), std::move(maps)});
    batch_.clear();
  }
  bool flushing = false;
  {
    const Lock lock(mutex_);
    flushing = flushing_;
  }
  const bool waits = transactions_.size() > 1 && Clock::now() < retry_;
  if (waits && !flushing) return {};
  Status committed = commit_transactions();
  if (committed || flushing || !may_wait_for_disk(committed)) return committed;
  note_disk(committed);
  retry_ = Clock::now() + kRetry;
  return {};
}

// In their order, until one fails.
Status RunRecorder::commit_transactions() {
  StageClock clock(CLOCK_THREAD_CPUTIME_ID);
  clock.show_in(running_);
  for (; !transactions_.empty(); transactions_.pop_front()) {
    const Transaction& next = transactions_.front();
    Status committed = clock.measure("commit", [&] { return store_.commit(next.steps, next.checkpoint, next.maps); });
    if (!committed) return committed;
    uncommitted_ -= next.steps.size();
    const Lock lock(mutex_);
    if (next.checkpoint) {
      maps_stored_ = next.maps.number;
      --checkpoints_waiting_;
    }
    statistics_.commits.push_back(clock.take().front());
    disk_error_.reset();
  }
  return {};
}

}  // namespace spartan::internal
