#include "spartan/system/internal/resumed_stream.h"

#include <algorithm>
#include <utility>

namespace spartan::internal {

// Samples that were processed are skipped without their images: those of hours are many GB. This can take a while, so
// it returns after `timeout`.
Result<StreamRead> ResumedStream::read(std::chrono::nanoseconds timeout) {
  const auto until = std::chrono::steady_clock::now() + timeout;
  while (is_catching_up()) {
    Recording& recording = *recordings_[next_];
    const auto key = recording.peek();
    if (!key) return failure(key);
    if (!*key) {
      ++next_;
      continue;
    }
    last_id_ = std::max(last_id_, (*key)->frame_id.value_or(last_id_));
    if (is_new((*key)->source, (*key)->stamp)) {
      auto sample = recording.next();
      if (!sample) return failure(sample);
      return StreamRead{StreamRead::State::sample, std::move(*sample), std::chrono::steady_clock::now()};
    }
    if (Status skipped = recording.skip(); !skipped) return failure(skipped);
    if (const auto now = std::chrono::steady_clock::now(); now >= until)
      return StreamRead{StreamRead::State::none_yet, {}, now};
  }
  if (!std::exchange(live_has_begun_, true)) {
    live_.number_after(last_id_);
    const auto latest =
        std::max_element(last_.begin(), last_.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    if (latest != last_.end()) live_.start_after(latest->second);
  }
  auto read = live_.read(timeout);
  if (!read || read->state != StreamRead::State::sample) return read;
  if (!is_new(source_of(*read->sample), stamp_of(*read->sample)))
    return StreamRead{StreamRead::State::none_yet, {}, read->arrived};
  return read;
}

bool ResumedStream::is_new(const std::string& source, Stamp stamp) {
  const auto [last, first] = last_.try_emplace(source, stamp);
  if (!first && stamp <= last->second) return false;
  last->second = stamp;
  return true;
}

Result<StereoFrame> ResumedStream::frame_at(const std::string& pair, Stamp left_stamp) {
  Result<StereoFrame> frame = failure(ErrorCode::input, "has no recorded frame", info().path);
  for (const auto& recording : recordings_) {
    frame = recording->frame_at(pair, left_stamp);
    if (frame || frame.error().code != ErrorCode::input) return frame;
  }
  return frame;
}

}  // namespace spartan::internal
