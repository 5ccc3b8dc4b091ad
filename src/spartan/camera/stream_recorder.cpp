#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <new>
#include <optional>
#include <thread>
#include <utility>
#include <variant>

#include "spartan/camera/recording_writer.h"
#include "spartan/core/files.h"
#include "spartan/core/stage_clock.h"

namespace spartan {
namespace {

constexpr std::chrono::seconds kSyncEvery{1};

}  // namespace

struct StreamRecorder::State {
  explicit State(RecordingWriter writer_in) : writer(std::move(writer_in)) {}

  struct Waiting {
    Sample sample;
    std::int64_t number;  // of all samples that were added, from 1
  };

  RecordingWriter writer;  // of the thread, until it has ended
  mutable std::mutex mutex;
  std::condition_variable changed;
  std::deque<Waiting> waiting;
  std::size_t bytes = 0;
  bool ended = false;
  std::int64_t added = 0, written = 0, synced = 0, sync_at = 0;  // numbers of samples
  RecorderProgress progress;
  std::thread thread;

  void run();
  Status write_counted(const Sample& sample);
  Status write(const Sample& sample);
};

Result<std::unique_ptr<StreamRecorder>> StreamRecorder::create(const std::string& folder, const StreamInfo& info,
                                                               ImageFiles images) {
  // Samples of the IMU are in the axes of the body; a recording would rotate them again.
  Rig rig = info.rig;
  rig.imu.body_from_imu = Pose::from_translation(rig.imu.body_from_imu.translation());
  auto writer = RecordingWriter::create_batched(folder, rig, recording_options_of(info), images);
  if (!writer) return failure(writer);
  const auto stored = with_self_masks_in(folder, rig, info.mask_folder());
  if (!stored) return failure(stored);
  if (Status s = write_file_atomically(folder + "/rig.yaml", to_rig_yaml(*stored)); !s) return failure(s);
  return std::unique_ptr<StreamRecorder>(new StreamRecorder(std::make_unique<State>(std::move(*writer))));
}

StreamRecorder::StreamRecorder(std::unique_ptr<State> state) : state_(std::move(state)) {
  state_->thread = std::thread([s = state_.get()] { s->run(); });
}

StreamRecorder::~StreamRecorder() {
  if (state_->thread.joinable()) static_cast<void>(finish());
}

void StreamRecorder::add(const Sample& sample) {
  const auto* missing = std::get_if<MissingFrame>(&sample);
  if (missing != nullptr && !missing->partial) return;
  const std::size_t bytes = image_bytes(sample);
  {
    const std::lock_guard lock(state_->mutex);
    if (!state_->progress.status) return;
    ++state_->added;
    if (state_->bytes + bytes > kMostBytes) {
      ++state_->progress.dropped;
      return;
    }
    state_->bytes += bytes;
    state_->waiting.push_back({sample, state_->added});
  }
  state_->changed.notify_all();
}

Status StreamRecorder::finish() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->ended = true;
  }
  state_->changed.notify_all();
  if (state_->thread.joinable()) {
    state_->thread.join();
    // What was written before an error stays an unfinished recording, which can be opened.
    if (state_->progress.status) state_->progress.status = state_->writer.finish();
  }
  return state_->progress.status;
}

std::int64_t StreamRecorder::added() const {
  const std::lock_guard lock(state_->mutex);
  return state_->added;
}

bool StreamRecorder::is_synced(std::int64_t count) {
  const std::lock_guard lock(state_->mutex);
  if (state_->synced >= count || state_->ended || !state_->progress.status) return true;
  state_->sync_at = std::max(state_->sync_at, count);
  state_->changed.notify_all();
  return false;
}

RecorderProgress StreamRecorder::progress() const {
  const std::lock_guard lock(state_->mutex);
  return state_->progress;
}

// One sample at a time: a sync that is due does not wait for all that a slow disk has before it.
void StreamRecorder::State::run() {
  auto next_sync = std::chrono::steady_clock::now() + kSyncEvery;
  std::unique_lock lock(mutex);
  for (;;) {
    const auto sync_wanted = [this] { return sync_at > synced && written >= sync_at; };
    changed.wait_until(lock, next_sync, [&] { return ended || sync_wanted() || !waiting.empty(); });
    std::optional<Waiting> next;
    if (!waiting.empty()) {
      next = std::move(waiting.front());
      waiting.pop_front();
    }
    const bool sync = sync_wanted() || std::chrono::steady_clock::now() >= next_sync;
    lock.unlock();
    Status status;
    try {
      if (next) status = write_counted(next->sample);
      if (status && sync) status = writer.sync();
    } catch (const std::bad_alloc& exception) {
      status = tl::unexpected(out_of_memory(exception));
    }
    if (sync) next_sync = std::chrono::steady_clock::now() + kSyncEvery;
    const std::int64_t number = next ? next->number : 0;
    const std::size_t freed = next ? image_bytes(next->sample) : 0;
    next.reset();
    lock.lock();
    bytes -= freed;
    if (!status) progress.status = status;
    // Those that did not fit into the queue are not waited for.
    written = waiting.empty() ? added : waiting.front().number - 1;
    if (status && sync) synced = number > 0 ? number : written;
    changed.notify_all();
    if (status && !(ended && waiting.empty())) continue;
    waiting.clear();
    return;
  }
}

Status StreamRecorder::State::write_counted(const Sample& sample) {
  Status status = write(sample);
  const bool is_frame = std::holds_alternative<StereoFrame>(sample) || std::holds_alternative<MissingFrame>(sample);
  const std::lock_guard lock(mutex);
  if (status) {
    ++(is_frame ? progress.frames : progress.sensor_samples);
  } else if (status.error().code == ErrorCode::input) {
    ++progress.rejected;
    return {};
  }
  return status;
}

Status StreamRecorder::State::write(const Sample& sample) {
  return std::visit(
      [this](const auto& s) -> Status {
        if constexpr (std::is_same_v<std::decay_t<decltype(s)>, MissingFrame>) {
          return writer.add_partial(*s.partial);
        } else {
          return writer.add(s);
        }
      },
      sample);
}

}  // namespace spartan
