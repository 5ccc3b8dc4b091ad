#include "spartan/system/internal/queued_stream.h"

#include <new>
#include <utility>

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
      if (recorder_ != nullptr) recorder_->add(*read->sample);
      queue_.push(std::move(*read));
    }
    queue_.close({});
  } catch (const std::bad_alloc& exception) {
    queue_.close(tl::unexpected(out_of_memory(exception)));
  }
}

}  // namespace spartan::internal
