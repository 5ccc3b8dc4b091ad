#include "spartan/camera/internal/increasing_stream.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "spartan/camera/internal/stamp_order.h"

namespace spartan::internal {

void IncreasingStream::look_ahead() {
  while (ahead_.size() < kLookAhead && !ended_ && !fault_) {
    auto row = rows_->next();
    if (!row) {
      fault_ = row.error();
    } else if (!*row) {
      ended_ = true;
    } else if (!last_ || stamp_of(**row) > *last_) {
      ahead_.push_back(std::move(**row));
    } else {
      ++reversed_;
    }
  }
}

bool IncreasingStream::front_is_outlier() const {
  const Stamp front = stamp_of(ahead_.front());
  const auto falls = [&](const Sample& row) { return stamp_of(row) <= front; };
  if (std::none_of(ahead_.begin() + 1, ahead_.end(), falls)) return false;
  std::vector<Stamp> stamps;
  stamps.reserve(ahead_.size());
  for (const Sample& row : ahead_) stamps.push_back(stamp_of(row));
  return find_reversals(stamps).front();
}

Result<std::optional<Sample>> IncreasingStream::next() {
  for (look_ahead(); !ahead_.empty(); look_ahead()) {
    const bool discard = front_is_outlier();
    Sample front = std::move(ahead_.front());
    ahead_.pop_front();
    if (discard) {
      ++reversed_;
      continue;
    }
    last_ = stamp_of(front);
    reversed_ +=
        static_cast<std::int64_t>(std::erase_if(ahead_, [&](const Sample& row) { return stamp_of(row) <= *last_; }));
    return std::optional(std::move(front));
  }
  if (fault_) return tl::unexpected(*fault_);
  return std::nullopt;
}

}  // namespace spartan::internal
