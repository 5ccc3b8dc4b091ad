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

/// A thread that looks at the stages of others ten times a second. Where one runs for longer than `limit_s`, it calls
/// `hung` with the name of the stage and its time, once.
class Watchdog {
 public:
  using Hung = std::function<void(const std::string& stage, double seconds)>;
  /// `watched` is borrowed.
  Watchdog(std::vector<const RunningStage*> watched, double limit_s, Hung hung);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

 private:
  void run();

  std::vector<const RunningStage*> watched_;
  double limit_s_;
  Hung hung_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool ended_ = false;
  std::thread thread_;
};

}  // namespace spartan::internal
