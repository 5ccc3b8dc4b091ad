#include "spartan/system/internal/resumed_stream.h"

#include <algorithm>
#include <utility>
#include <variant>

namespace spartan::internal {

Result<StreamRead> ResumedStream::read(std::chrono::nanoseconds timeout) {
  while (is_catching_up()) {
    auto sample = recordings_[next_]->next();
    if (!sample) return failure(sample);
    if (!*sample) {
      ++next_;
      continue;
    }
    if (const auto* frame = std::get_if<StereoFrame>(&**sample)) last_id_ = std::max(last_id_, frame->frame_id);
    if (const auto* missing = std::get_if<MissingFrame>(&**sample)) last_id_ = std::max(last_id_, missing->frame_id);
    if (is_new(source_of(**sample), stamp_of(**sample)))
      return StreamRead{StreamRead::State::sample, std::move(*sample), std::chrono::steady_clock::now()};
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
