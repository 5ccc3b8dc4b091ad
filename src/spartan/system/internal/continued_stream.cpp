#include "spartan/system/internal/continued_stream.h"

#include <fmt/format.h>

namespace spartan::internal {

namespace {

constexpr std::int64_t kGap_ns = 1'000'000'000;

}  // namespace

void ContinuedStream::start_after(Stamp stamp) {
  if (!behind().is_repeatable()) latest_ = stamp;
  behind().start_after(stamp);
}

Result<StreamRead> ContinuedStream::read(std::chrono::nanoseconds timeout) {
  auto read = behind().read(timeout);
  if (!read || read->state != StreamRead::State::sample) return read;
  if (latest_) {
    const Stamp first = stamp_of(*read->sample);
    if (first <= *latest_) {
      moved_ns_ = latest_->ns + kGap_ns - first.ns;
      log_.warning(
          fmt::format("the clock of this computer is {:.1f} s behind the last sample of the run: stamps are moved by "
                      "that time and a second more",
                      seconds_between(first, *latest_)));
    }
    latest_.reset();
  }
  if (moved_ns_ != 0) move_stamps(*read->sample, moved_ns_);
  return read;
}

}  // namespace spartan::internal
