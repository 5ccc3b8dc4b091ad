// The back end: work that no frame waits for.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

#include "spartan/core/stage_clock.h"
#include "spartan/core/threads.h"

namespace spartan::internal {

/// Runs jobs one after the other, in their order, beside the thread that submits them.
class BackEnd {
 public:
  /// Identifies a job; later jobs have larger ones. 0: no job.
  using Ticket = std::uint64_t;

  /// `own_thread`: a thread of its own, of low priority, runs the jobs, whose loops do not use `workers`. Otherwise a
  /// worker of the pool runs them, or wait() itself.
  BackEnd(const ThreadPool& workers, bool own_thread);
  ~BackEnd() { stop(); }
  BackEnd(const BackEnd&) = delete;
  BackEnd& operator=(const BackEnd&) = delete;

  /// For the loops of the jobs, which stop() ends.
  const ThreadPool& workers() const { return loops_; }
  /// For those of jobs that use no other thread.
  const ThreadPool& one_thread() const { return one_thread_; }

  /// `name`: a string literal, for running().
  Ticket submit(const char* name, std::function<void()> job);
  bool is_done(Ticket ticket) const;
  /// Number of jobs that have not ended.
  std::uint64_t backlog() const;
  /// Returns when the job and all before it have ended. Rethrows what a job has thrown, at each call; jobs after that
  /// one do not run.
  void wait(Ticket ticket);
  /// The job that runs now.
  const RunningStage& running() const { return running_; }
  /// Cancels the loops of the job that has begun and waits for its end; the others never run.
  void stop();

  /// Difference of the nice value of its own thread to that of the process.
  static constexpr int kNiceness = 19;

 private:
  using Lock = std::unique_lock<std::mutex>;
  bool can_run() const { return !busy_ && !jobs_.empty(); }
  void run_next(Lock& lock);
  void start_pump();
  void pump();
  void run_thread();

  ThreadPool pool_, loops_, one_thread_;
  bool own_thread_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  struct Job {
    const char* name;
    std::function<void()> work;
  };
  std::deque<Job> jobs_;
  RunningStage running_;
  std::uint64_t submitted_ = 0, finished_ = 0;
  bool busy_ = false, pumping_ = false, stopped_ = false;
  int waiting_ = 0;
  std::exception_ptr error_;
  BackgroundTask pump_task_;
  std::thread thread_;
};

}  // namespace spartan::internal
