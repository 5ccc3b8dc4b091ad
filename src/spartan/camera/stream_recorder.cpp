#include <condition_variable>
#include <deque>
#include <mutex>
#include <new>
#include <thread>
#include <utility>
#include <variant>

#include "spartan/camera/recording_writer.h"
#include "spartan/core/stage_clock.h"

namespace spartan {
namespace {

constexpr std::chrono::seconds kSyncEvery{1};

std::size_t bytes_of(const Sample& sample) {
  const auto* frame = std::get_if<StereoFrame>(&sample);
  return frame != nullptr ? frame->left.bytes() + frame->right.bytes() : 0;
}

}  // namespace

struct StreamRecorder::State {
  explicit State(RecordingWriter writer_in) : writer(std::move(writer_in)) {}

  RecordingWriter writer;  // of the thread, until it has ended
  mutable std::mutex mutex;
  std::condition_variable changed;
  std::deque<Sample> waiting;
  std::size_t bytes = 0;
  bool ended = false;
  RecorderProgress progress;
  std::thread thread;

  void run();
  Status write_all(std::deque<Sample> samples);
  Status write(const Sample& sample);
};

Result<std::unique_ptr<StreamRecorder>> StreamRecorder::create(const std::string& folder, const StreamInfo& info,
                                                               ImageFiles images) {
  RecordingOptions options;
  options.name = info.name;
  options.description = info.description;
  options.noise = info.noise;
  if (info.gravity_m_s2) options.gravity_m_s2 = *info.gravity_m_s2;
  auto writer = RecordingWriter::create_batched(folder, info.rig, options, images);
  if (!writer) return failure(writer);
  return std::unique_ptr<StreamRecorder>(new StreamRecorder(std::make_unique<State>(std::move(*writer))));
}

StreamRecorder::StreamRecorder(std::unique_ptr<State> state) : state_(std::move(state)) {
  state_->thread = std::thread([s = state_.get()] { s->run(); });
}

StreamRecorder::~StreamRecorder() {
  if (state_->thread.joinable()) static_cast<void>(finish());
}

void StreamRecorder::add(const Sample& sample) {
  if (std::holds_alternative<MissingFrame>(sample)) return;
  const std::size_t bytes = bytes_of(sample);
  {
    const std::lock_guard lock(state_->mutex);
    if (!state_->progress.status) return;
    if (state_->bytes + bytes > kMostBytes) {
      ++state_->progress.dropped;
      return;
    }
    state_->bytes += bytes;
    state_->waiting.push_back(sample);
  }
  state_->changed.notify_one();
}

Status StreamRecorder::finish() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->ended = true;
  }
  state_->changed.notify_one();
  if (state_->thread.joinable()) {
    state_->thread.join();
    // What was written before an error stays an unfinished recording.
    if (state_->progress.status) state_->progress.status = state_->writer.finish();
  }
  return state_->progress.status;
}

RecorderProgress StreamRecorder::progress() const {
  const std::lock_guard lock(state_->mutex);
  return state_->progress;
}

void StreamRecorder::State::run() {
  auto next_sync = std::chrono::steady_clock::now() + kSyncEvery;
  for (;;) {
    std::deque<Sample> samples;
    bool last = false;
    {
      std::unique_lock lock(mutex);
      changed.wait_until(lock, next_sync, [this] { return ended || !waiting.empty(); });
      samples.swap(waiting);
      last = ended;
    }
    Status status;
    try {
      status = write_all(std::move(samples));
      if (status && std::chrono::steady_clock::now() >= next_sync) {
        status = writer.sync();
        next_sync = std::chrono::steady_clock::now() + kSyncEvery;
      }
    } catch (const std::bad_alloc& exception) {
      status = tl::unexpected(out_of_memory(exception));
    }
    if (status && !last) continue;
    const std::lock_guard lock(mutex);
    if (!status) progress.status = status;
    waiting.clear();
    return;
  }
}

Status StreamRecorder::State::write_all(std::deque<Sample> samples) {
  for (; !samples.empty(); samples.pop_front()) {
    const Status written = write(samples.front());
    const bool is_frame = std::holds_alternative<StereoFrame>(samples.front());
    const std::lock_guard lock(mutex);
    bytes -= bytes_of(samples.front());
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
          return {};
        } else {
          return writer.add(s);
        }
      },
      sample);
}

}  // namespace spartan
