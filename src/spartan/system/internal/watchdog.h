// Notices that a thread of a run hangs.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "spartan/core/stage_clock.h"

namespace spartan::internal {

/// What a watchdog looks at. Borrowed.
struct WatchedStage {
  const RunningStage* stage;
  double limit_s;  ///< longest time that it may run
};

/// A thread that looks at the stages of others ten times a second. Where one runs for longer than its limit, it calls
/// `hung` with the name of the stage and its time, once.
class Watchdog {
 public:
  using Hung = std::function<void(const std::string& stage, double seconds)>;
  Watchdog(std::vector<WatchedStage> watched, Hung hung);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

 private:
  void run();

  std::vector<WatchedStage> watched_;
  Hung hung_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool ended_ = false;
  std::thread thread_;
};

}  // namespace spartan::internal
