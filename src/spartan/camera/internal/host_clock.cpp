#include "spartan/camera/internal/host_clock.h"

namespace spartan::internal {

HostClock::HostClock()
    : steady_(std::chrono::steady_clock::now()),
      epoch_ns_(
          std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
              .count()) {}

Stamp HostClock::stamp_of(Time time) const {
  return Stamp{epoch_ns_ + std::chrono::duration_cast<std::chrono::nanoseconds>(time - steady_).count()};
}

}  // namespace spartan::internal
