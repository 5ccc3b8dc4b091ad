#include <condition_variable>
#include <deque>
#include <mutex>
#include <new>
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

  RecordingWriter writer;  // of the thread, until it has ended
  mutable std::mutex mutex;
  std::condition_variable changed;
  std::deque<Sample> waiting;
  std::size_t bytes = 0;
  bool ended = false, sync_now = false;
  std::int64_t added = 0, synced = 0;  // samples
  RecorderProgress progress;
  std::thread thread;

  void run();
  Status write_all(std::deque<Sample> samples);
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
    state_->waiting.push_back(sample);
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
    // What was written before an error stays an unfinished recording.
    if (state_->progress.status) state_->progress.status = state_->writer.finish();
  }
  return state_->progress.status;
}

std::int64_t StreamRecorder::added() const {
  const std::lock_guard lock(state_->mutex);
  return state_->added;
}

void StreamRecorder::wait_until_synced(std::int64_t count) {
  std::unique_lock lock(state_->mutex);
  state_->sync_now = state_->synced < count;
  state_->changed.notify_all();
  state_->changed.wait(lock, [&] { return state_->synced >= count || state_->ended || !state_->progress.status; });
}

RecorderProgress StreamRecorder::progress() const {
  const std::lock_guard lock(state_->mutex);
  return state_->progress;
}

void StreamRecorder::State::run() {
  auto next_sync = std::chrono::steady_clock::now() + kSyncEvery;
  for (;;) {
    std::deque<Sample> samples;
    bool last = false, sync = false;
    std::int64_t taken = 0;
    {
      std::unique_lock lock(mutex);
      changed.wait_until(lock, next_sync, [this] { return ended || sync_now || !waiting.empty(); });
      samples.swap(waiting);
      last = ended;
      sync = std::exchange(sync_now, false) || std::chrono::steady_clock::now() >= next_sync;
      taken = added;
    }
    Status status;
    try {
      status = write_all(std::move(samples));
      if (status && sync) {
        status = writer.sync();
        next_sync = std::chrono::steady_clock::now() + kSyncEvery;
      }
    } catch (const std::bad_alloc& exception) {
      status = tl::unexpected(out_of_memory(exception));
    }
    const std::lock_guard lock(mutex);
    if (!status) progress.status = status;
    if (status && sync) synced = taken;
    if (status && !last) {
      changed.notify_all();
      continue;
    }
    waiting.clear();
    changed.notify_all();
    return;
  }
}

Status StreamRecorder::State::write_all(std::deque<Sample> samples) {
  for (; !samples.empty(); samples.pop_front()) {
    Status written = write(samples.front());
    const Sample& sample = samples.front();
    const bool is_frame = std::holds_alternative<StereoFrame>(sample) || std::holds_alternative<MissingFrame>(sample);
    const std::lock_guard lock(mutex);
    bytes -= image_bytes(samples.front());
    if (written) {
      ++(is_frame ? progress.frames : progress.sensor_samples);
    } else if (written.error().code == ErrorCode::input) {
      ++progress.rejected;
    } else {
      return written;
    }
  }
  return {};
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
