#include "spartan/system/internal/watchdog.h"

#include <chrono>
#include <utility>

namespace spartan::internal {

Watchdog::Watchdog(std::vector<const RunningStage*> watched, double limit_s, Hung hung)
    : watched_(std::move(watched)), limit_s_(limit_s), hung_(std::move(hung)), thread_([this] { run(); }) {}

Watchdog::~Watchdog() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void Watchdog::run() {
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, std::chrono::milliseconds(100), [this] { return ended_; })) {
    for (const RunningStage* running : watched_) {
      const char* stage = running->stage();
      const double seconds = running->seconds();
      if (stage == nullptr || seconds < limit_s_) continue;
      hung_(stage, seconds);
      return;
    }
  }
}

}  // namespace spartan::internal
