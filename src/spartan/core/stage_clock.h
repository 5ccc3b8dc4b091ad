// Timing of pipeline stages and resource usage, for reports only; no result depends on them.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <new>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "spartan/core/result.h"

namespace spartan {

/// Wall-clock and CPU time of one stage.
struct StageTime {
  std::string stage;
  double wall_ms = 0;
  double cpu_ms = 0;  ///< of all threads of the process, that of a stage in the background included
};

/// Thrown by StageClock::measure() in place of std::bad_alloc: tells the stage in which memory ran out.
class OutOfMemory : public std::bad_alloc {
 public:
  /// `stage` must be a string literal: there is no memory for a copy.
  explicit OutOfMemory(const char* stage) : stage_(stage) {}
  const char* stage() const { return stage_; }

 private:
  const char* stage_;
};

/// The error of code `resources` for a failed allocation; names the stage if it is known.
Error out_of_memory(const std::bad_alloc& exception);

/// Wall-clock time between laps.
class Stopwatch {
 public:
  /// Milliseconds since the previous lap, or since construction.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// What a thread does now, for another thread that watches it.
class RunningStage {
 public:
  using Clock = std::chrono::steady_clock;
  /// Returns the stage before, null where there was none. `stage` must be a string literal.
  const char* begin(const char* stage) {
    since_ = Clock::now().time_since_epoch().count();
    return stage_.exchange(stage);
  }
  /// Goes on with the stage before.
  void end(const char* before) { begin(before); }
  /// Null where there is none.
  const char* stage() const { return stage_; }
  double seconds() const {
    return std::chrono::duration<double>(Clock::now().time_since_epoch() - Clock::duration(since_)).count();
  }

 private:
  std::atomic<const char*> stage_ = nullptr;
  std::atomic<Clock::rep> since_ = 0;
};

/// Measures the times of consecutive stages.
class StageClock {
 public:
  StageClock() = default;
  /// `cpu_clock`: CLOCK_THREAD_CPUTIME_ID for stages that one thread runs beside others, instead of that of the
  /// process.
  explicit StageClock(clockid_t cpu_clock) : cpu_clock_(cpu_clock) {}
  /// From now on the stage that is measured is the running one. Borrowed.
  void show_in(RunningStage& running) { running_ = &running; }

  /// Runs `work`, records its time under the name `stage`, and returns its result. Nothing is recorded where `work`
  /// throws.
  template <class Work>
  auto measure(const char* stage, Work&& work) {
    const Lap lap = now();
    const Shown shown(running_, stage);
    try {
      if constexpr (std::is_void_v<std::invoke_result_t<Work>>) {
        std::forward<Work>(work)();
        record(stage, lap);
      } else {
        auto result = std::forward<Work>(work)();
        record(stage, lap);
        return result;
      }
    } catch (const OutOfMemory&) {
      throw;  // of a stage inside this one
    } catch (const std::bad_alloc&) {
      throw OutOfMemory(stage);
    }
  }
  /// Appends times measured elsewhere.
  void add(const std::vector<StageTime>& times) { times_.insert(times_.end(), times.begin(), times.end()); }
  /// Returns the times recorded since the last call, in order, and clears them.
  std::vector<StageTime> take() { return std::exchange(times_, {}); }

 private:
  static double now_ms(clockid_t clock) {
    timespec t{};
    ::clock_gettime(clock, &t);
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
  }
  struct Lap {
    double wall_ms, cpu_ms;
  };
  class Shown {
   public:
    Shown(RunningStage* running, const char* stage) : running_(running) {
      if (running_ != nullptr) before_ = running_->begin(stage);
    }
    ~Shown() {
      if (running_ != nullptr) running_->end(before_);
    }
    Shown(const Shown&) = delete;
    Shown& operator=(const Shown&) = delete;

   private:
    RunningStage* running_;
    const char* before_ = nullptr;
  };
  Lap now() const { return {now_ms(CLOCK_MONOTONIC), now_ms(cpu_clock_)}; }
  // Not in a destructor, which must not throw: it allocates.
  void record(const char* stage, const Lap& begin) {
    const Lap end = now();
    times_.push_back({stage, end.wall_ms - begin.wall_ms, end.cpu_ms - begin.cpu_ms});
  }

  clockid_t cpu_clock_ = CLOCK_PROCESS_CPUTIME_ID;
  RunningStage* running_ = nullptr;
  std::vector<StageTime> times_;
};

/// Memory that this process can still allocate, bytes: the least of what the machine has available (MemAvailable), what
/// the control group leaves (cgroup v1 and v2; page cache that can be dropped counts as free) and what the limits of
/// the process leave (ulimit -v). At least 1.
std::int64_t available_memory_bytes();

/// CPU time of all threads since the start of the process, s.
double cpu_seconds();
/// The peak resident memory of the process, bytes.
std::int64_t peak_memory_bytes();

}  // namespace spartan
