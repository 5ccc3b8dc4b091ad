#include "spartan/system/internal/sample_queue.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>

namespace spartan::internal {
namespace {

bool is_frame(const Sample& sample) {
  return std::holds_alternative<StereoFrame>(sample) || std::holds_alternative<MissingFrame>(sample);
}

}  // namespace

void SampleQueue::push(StreamRead read) {
  {
    const std::lock_guard lock(mutex_);
    bytes_ += image_bytes(*read.sample);
    if (!is_frame(*read.sample)) ++sensor_samples_;
    reads_.push_back(std::move(read));
    make_room();
    peak_bytes_ = std::max(peak_bytes_, bytes_);
  }
  arrived_.notify_one();
}

void SampleQueue::make_room() {
  const auto drop = [&](bool view) {
    return drop_oldest(view, fmt::format("dropped: {} MB of images waited to be processed", most_bytes_ >> 20U));
  };
  while (bytes_ > most_bytes_ && (drop(true) || drop(false))) {
  }
  if (sensor_samples_ <= kMostSensorSamples) return;
  const auto oldest =
      std::find_if(reads_.begin(), reads_.end(), [](const StreamRead& read) { return !is_frame(*read.sample); });
  reads_.erase(oldest);
  --sensor_samples_;
  ++dropped_.sensor_samples;
}

// One view for each frame that comes too late, as long as there are views.
void SampleQueue::drop_if_late(std::chrono::steady_clock::time_point now) {
  const StreamRead& next = reads_.front();
  if (longest_wait_ == std::chrono::nanoseconds::zero() || image_bytes(*next.sample) == 0) return;
  const std::chrono::duration<double> waited = now - next.arrived;
  if (waited <= longest_wait_) return;
  const std::string reason = fmt::format("dropped: images waited for {:.1f} s to be processed", waited.count());
  if (!drop_oldest(true, reason)) drop_oldest(false, reason);
}

// Whether there was one. Its place in the order stays.
bool SampleQueue::drop_oldest(bool view, const std::string& reason) {
  for (StreamRead& read : reads_) {
    const std::size_t bytes = image_bytes(*read.sample);
    if (bytes == 0 || (source_of(*read.sample) != odometry_pair_) != view) continue;
    if (auto* const missing = std::get_if<MissingFrame>(&*read.sample)) {
      missing->partial.reset();
      missing->message += "; the other image was " + reason;
    } else {
      const auto& frame = std::get<StereoFrame>(*read.sample);
      MissingFrame dropped{frame.frame_id, frame.pair, frame.left_stamp, FrameFault::dropped, reason, {}};
      read.sample = std::move(dropped);
    }
    bytes_ -= bytes;
    ++(view ? dropped_.views : dropped_.odometry);
    return true;
  }
  return false;
}

void SampleQueue::close(Status reason) {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    reason_ = std::move(reason);
  }
  arrived_.notify_one();
}

Result<StreamRead> SampleQueue::pop(std::chrono::nanoseconds timeout) {
  std::unique_lock lock(mutex_);
  arrived_.wait_for(lock, timeout, [this] { return !reads_.empty() || closed_; });
  const auto now = std::chrono::steady_clock::now();
  if (reads_.empty() && !closed_) return StreamRead{StreamRead::State::none_yet, {}, now};
  if (reads_.empty() && !reason_) return failure(reason_);
  if (reads_.empty()) return StreamRead{StreamRead::State::end, {}, now};
  drop_if_late(now);
  StreamRead read = std::move(reads_.front());
  reads_.pop_front();
  bytes_ -= image_bytes(*read.sample);
  if (!is_frame(*read.sample)) --sensor_samples_;
  return read;
}

DroppedFrames SampleQueue::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

std::size_t SampleQueue::peak_bytes() const {
  const std::lock_guard lock(mutex_);
  return peak_bytes_;
}

}  // namespace spartan::internal
