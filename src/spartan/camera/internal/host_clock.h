// The clock of the host that stamps of live streams are on.
#pragma once

#include <chrono>
#include <cstdint>

#include "spartan/core/time.h"

namespace spartan::internal {

/// Host time: nanoseconds since the epoch when the clock was made, and since then those of the steady clock, so that a
/// correction of the system's time does not reach the stamps.
class HostClock {
 public:
  using Time = std::chrono::steady_clock::time_point;
  HostClock();
  Stamp stamp_of(Time time) const;
  Stamp now() const { return stamp_of(std::chrono::steady_clock::now()); }

 private:
  Time steady_;
  std::int64_t epoch_ns_;
};

}  // namespace spartan::internal
