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
  return std::unique_ptr<RunRecorder>(
      new RunRecorder(std::move(store), std::move(owned), std::move(*tiles), std::move(folder), options, pace));
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
    result.terrain.reset();
    if (result.stop) result.step.map = record_of(*result.stop);
    result.stop.reset();
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
    changed_.wait(
        lock, [this] { return !status_ || (waiting_.empty() && !busy_ && batch_.empty() && transactions_.empty()); });
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

std::chrono::steady_clock::time_point RunRecorder::commit_time() const {
  return oldest_ + seconds(options_.every_s);
}

// When there is something to do without another result.
std::chrono::steady_clock::time_point RunRecorder::wake_time() const {
  const auto never = std::chrono::steady_clock::time_point::max();
  return std::min(batch_.empty() ? never : commit_time(), transactions_.empty() ? never : retry_);
}

void RunRecorder::run() {
  Lock lock(mutex_);
  for (;;) {
    const auto has_work = [this] {
      return ended_ || !waiting_.empty() || (flushing_ && !(batch_.empty() && transactions_.empty()));
    };
    if (batch_.empty() && transactions_.empty()) {
      changed_.wait(lock, has_work);
    } else {
      changed_.wait_until(lock, wake_time(), has_work);
    }
    if (ended_ || !status_) return;
    std::optional<RunResult> next;
    if (!waiting_.empty()) {
      next = std::move(waiting_.front());
      waiting_.pop_front();
      files_waiting_ -= files_of(*next);
    }
    busy_ = true;
    lock.unlock();
    Status status;
    try {
      status = next ? process(std::move(*next)) : commit({}, {});  // also where a retry is due
    } catch (const std::bad_alloc& exception) {
      status = tl::unexpected(out_of_memory(exception));
    }
    lock.lock();
    busy_ = false;
    if (!status) status_ = status;
    changed_.notify_all();
  }
}

Status RunRecorder::process(RunResult result) {
  if (Status written = write_files(result); !written) {
    if (!may_wait_for_disk(written)) return written;
    note_disk(written);
    if (result.stop && !result.step.map) result.step.map = record_of(*result.stop);
    const Lock lock(mutex_);
    statistics_.files_discarded += static_cast<std::int64_t>(files_of(result));
  }
  if (batch_.empty()) oldest_ = std::chrono::steady_clock::now();
  batch_.push_back(std::move(result.step));
  const bool due = result.checkpoint || result.commit_now || std::chrono::steady_clock::now() >= commit_time();
  if (result.checkpoint && result.before_checkpoint) {
    if (Status committed = commit({}, {}); !committed) return committed;  // frames do not wait for the recording
    StageClock clock(CLOCK_THREAD_CPUTIME_ID);
    clock.show_in(running_);
    clock.measure("recording", [&] { result.before_checkpoint(); });
  }
  return due ? commit(std::move(result.checkpoint), std::move(result.maps)) : Status();
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
  const bool waits = transactions_.size() > 1 && std::chrono::steady_clock::now() < retry_;
  if (waits && !flushing) return {};
  Status committed = commit_transactions();
  if (committed || flushing || !may_wait_for_disk(committed)) return committed;
  note_disk(committed);
  retry_ = std::chrono::steady_clock::now() + kRetry;
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
