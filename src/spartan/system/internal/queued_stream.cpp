#include "spartan/system/internal/queued_stream.h"

#include <algorithm>
#include <new>
#include <utility>
#include <variant>

#include "spartan/core/stage_clock.h"

namespace spartan::internal {

QueuedStream::~QueuedStream() {
  stop();
}

void QueuedStream::stop() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

Result<StreamRead> QueuedStream::read(std::chrono::nanoseconds timeout) {
  if (!thread_.joinable() && !stop_) thread_ = std::thread([this] { pump(); });
  return queue_.pop(timeout);
}

void QueuedStream::pump() {
  try {
    while (!stop_) {
      auto read = behind().read(kPoll);
      if (!read) return queue_.close(failure(read));
      if (read->state == StreamRead::State::end) break;
      if (read->state != StreamRead::State::sample) continue;
      number(*read->sample);
      if (recorder_ != nullptr) recorder_->add(*read->sample);
      queue_.push(std::move(*read));
    }
    queue_.close({});
  } catch (const std::bad_alloc& exception) {
    queue_.close(tl::unexpected(out_of_memory(exception)));
  }
}

// A stream that has begun again counts from 0.
void QueuedStream::number(Sample& sample) {
  auto* const frame = std::get_if<StereoFrame>(&sample);
  auto* const missing = std::get_if<MissingFrame>(&sample);
  if (!last_id_ || (frame == nullptr && missing == nullptr)) return;
  std::int64_t& id = frame != nullptr ? frame->frame_id : missing->frame_id;
  if (!id_offset_) id_offset_ = std::max<std::int64_t>(0, *last_id_ + 1 - id);
  id += *id_offset_;
  if (missing != nullptr && missing->partial) missing->partial->frame_id = id;
}

}  // namespace spartan::internal
