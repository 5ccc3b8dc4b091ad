#include "spartan/system/internal/resumed_stream.h"

#include <algorithm>
#include <utility>
#include <variant>

namespace spartan::internal {
namespace {

std::int64_t* id_of(Sample& sample) {
  if (auto* frame = std::get_if<StereoFrame>(&sample)) return &frame->frame_id;
  if (auto* missing = std::get_if<MissingFrame>(&sample)) return &missing->frame_id;
  return nullptr;
}

}  // namespace

Result<StreamRead> ResumedStream::read(std::chrono::nanoseconds timeout) {
  while (is_catching_up()) {
    auto sample = recordings_[next_]->next();
    if (!sample) return failure(sample);
    if (!*sample) {
      ++next_;
      continue;
    }
    if (const std::int64_t* id = id_of(**sample)) last_id_ = std::max(last_id_, *id);
    if (is_new(**sample))
      return StreamRead{StreamRead::State::sample, std::move(*sample), std::chrono::steady_clock::now()};
  }
  if (!std::exchange(live_has_begun_, true) && !last_.empty()) {
    const auto latest =
        std::max_element(last_.begin(), last_.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    behind().start_after(latest->second);
  }
  auto read = behind().read(timeout);
  if (!read || read->state != StreamRead::State::sample) return read;
  if (!is_new(*read->sample)) return StreamRead{StreamRead::State::none_yet, {}, read->arrived};
  number(*read->sample);
  return read;
}

bool ResumedStream::is_new(const Sample& sample) {
  const auto [last, first] = last_.try_emplace(source_of(sample), stamp_of(sample));
  if (!first && stamp_of(sample) <= last->second) return false;
  last->second = stamp_of(sample);
  return true;
}

// A stream that has begun again counts from 0.
void ResumedStream::number(Sample& sample) {
  std::int64_t* const id = id_of(sample);
  if (id == nullptr) return;
  if (*id + id_offset_ <= last_id_) id_offset_ = last_id_ + 1 - *id;
  *id += id_offset_;
  last_id_ = *id;
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
