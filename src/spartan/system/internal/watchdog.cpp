#include "spartan/system/internal/watchdog.h"

#include <chrono>
#include <utility>

namespace spartan::internal {

Watchdog::Watchdog(std::vector<WatchedStage> watched, Hung hung)
    : watched_(std::move(watched)), hung_(std::move(hung)), thread_([this] { run(); }) {}

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
    for (const WatchedStage& watched : watched_) {
      const char* stage = watched.stage->stage();
      const double seconds = watched.stage->seconds();
      if (stage == nullptr || seconds < watched.limit_s) continue;
      hung_(stage, seconds);
      return;
    }
  }
}

}  // namespace spartan::internal
