// A thread pool with a bounded number of threads, passed to the stages by value.
#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <memory>

namespace spartan {

/// Number of cores that this process may run on (`taskset`, containers), at least 1.
int available_cores();

/// A function that runs once, beside its caller, as ThreadPool::start() says. Empty, or to be waited for.
class BackgroundTask {
 public:
  BackgroundTask() = default;
  BackgroundTask(BackgroundTask&&) noexcept = default;
  BackgroundTask& operator=(BackgroundTask&& other) noexcept;
  /// Waits for the end of a function that has begun; one that has not begun never runs.
  ~BackgroundTask() { abandon(); }

  bool empty() const { return state_ == nullptr; }
  /// Returns when the function has returned. Runs it in this thread where no worker has begun it. Rethrows what it has
  /// thrown, at each call. Does nothing where the task is empty.
  void wait();

 private:
  friend class ThreadPool;
  struct State;
  void abandon() noexcept;
  std::shared_ptr<State> state_;
};

/// Thrown by the loops of a ThreadPool that was cancelled.
class Cancelled : public std::exception {
 public:
  const char* what() const noexcept override { return "cancelled"; }
};

/// A bounded set of worker threads (a TBB task arena). Copies share the threads.
class ThreadPool {
 public:
  /// `threads` ≥ 1 includes the calling thread; throws std::invalid_argument otherwise.
  explicit ThreadPool(int threads = 1);

  int threads() const { return threads_; }
  /// Runs body(begin, end) in parallel over disjoint parts of [begin, end), each of length `grain` (the last may be
  /// shorter). The parts depend only on `grain`, not on the number of threads, so that results can be independent of
  /// it. Returns when all parts are done; rethrows an exception of a part. Throws std::invalid_argument if grain < 1.
  void parallel_for(int begin, int end, int grain, const std::function<void(int, int)>& body) const;
  /// Runs body(part, worker) for each part in [0, parts). Each worker takes the next part that is left; `worker` is in
  /// [0, min(parts, threads())), and no two bodies with one worker run at the same time, so that it can be the index of
  /// buffers. Which worker has which part differs from run to run.
  void parallel_for_parts(int parts, const std::function<void(int, int)>& body) const;
  /// Runs both functions, in parallel if there is more than one thread.
  void parallel_invoke(const std::function<void()>& first, const std::function<void()>& second) const;
  /// Lets a worker run `work` while the caller goes on; with one thread it runs in BackgroundTask::wait(). The worker
  /// is one of the pool: meanwhile its loops have a thread less.
  BackgroundTask start(std::function<void()> work) const;

  /// The same threads. The loops of the result and of its copies can be ended by cancel().
  ThreadPool cancellable() const;
  /// From now on the loops throw Cancelled before their next part. Throws std::logic_error where the pool is not
  /// cancellable().
  void cancel() const;

 private:
  struct Arena;
  void throw_if_cancelled() const;
  int threads_ = 1;
  std::shared_ptr<Arena> arena_;
  std::shared_ptr<std::atomic<bool>> cancelled_;  // null: it cannot be
};

}  // namespace spartan
