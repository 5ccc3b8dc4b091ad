#include "spartan/core/threads.h"

#include <sched.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define SPARTAN_THREAD_SANITIZER 1
#endif
#endif

namespace spartan {

namespace {

#ifdef SPARTAN_THREAD_SANITIZER

// The installed TBB is not instrumented for the thread sanitizer, which would report its tasks as data races.
// Plain threads replace it.
class Workers {
 public:
  explicit Workers(int threads) : threads_(threads) {}

  void run(int parts, const std::function<void(int)>& part) const {
    std::atomic<int> next{0};
    std::exception_ptr error;
    std::mutex error_mutex;
    const auto work = [&] {
      for (int i = next++; i < parts; i = next++) {
        try {
          part(i);
        } catch (...) {
          const std::lock_guard lock(error_mutex);
          error = std::current_exception();
        }
      }
    };
    std::vector<std::thread> others;
    others.reserve(static_cast<std::size_t>(threads_ - 1));
    for (int i = 1; i < threads_; ++i) others.emplace_back(work);
    work();
    for (std::thread& other : others) other.join();
    if (error) std::rethrow_exception(error);
  }
  template <typename Work>
  static void enqueue(Work work) {
    std::thread(work).detach();
  }

 private:
  int threads_;
};

#else

class Workers {
 public:
  explicit Workers(int threads) : tasks_(threads) {}

  void run(int parts, const std::function<void(int)>& part) {
    tasks_.execute([&] { tbb::parallel_for(0, parts, 1, part, tbb::simple_partitioner{}); });
  }
  template <typename Work>
  void enqueue(const Work& work) {
    tasks_.enqueue(work);
  }

 private:
  tbb::task_arena tasks_;
};

#endif

}  // namespace

struct BackgroundTask::State {
  explicit State(std::function<void()> work_in) : work(std::move(work_in)) {}

  // Whether the caller is the first that wants to run it.
  bool claim() { return !claimed.exchange(true); }
  void run() {
    try {
      work();
    } catch (...) {
      error = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    done = true;
    changed.notify_all();
  }
  void wait_for_end() {
    std::unique_lock lock(mutex);
    changed.wait(lock, [this] { return done; });
  }

  std::function<void()> work;
  std::exception_ptr error;
  std::atomic<bool> claimed{false};
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false;
};

struct ThreadPool::Arena {
  using Task = std::shared_ptr<BackgroundTask::State>;

  explicit Arena(int threads) : workers(threads) {}
  // The queue of TBB outlives a program that ends, with the tasks in it that nobody waits for any more.
  ~Arena() {
    std::unique_lock lock(mutex);
    drained.wait(lock, [this] { return unfinished == 0; });
  }

  void start(Task task) {
    {
      const std::lock_guard lock(mutex);
      waiting.push_back(std::move(task));
      ++unfinished;
    }
    workers.enqueue([this] { run_next(); });
  }
  void run_next() {
    if (Task task = next(); task->claim()) task->run();
    const std::lock_guard lock(mutex);
    if (--unfinished == 0) drained.notify_all();
  }
  Task next() {
    const std::lock_guard lock(mutex);
    Task task = std::move(waiting.front());
    waiting.pop_front();
    return task;
  }

  Workers workers;
  std::mutex mutex;
  std::condition_variable drained;
  std::deque<Task> waiting;
  int unfinished = 0;
};

BackgroundTask& BackgroundTask::operator=(BackgroundTask&& other) noexcept {
  abandon();
  state_ = std::move(other.state_);
  return *this;
}

void BackgroundTask::wait() {
  if (!state_) return;
  if (state_->claim()) state_->run();
  state_->wait_for_end();
  state_->work = nullptr;  // freed by the owner, not by a worker: it may hold the pool
  if (state_->error) std::rethrow_exception(state_->error);
}

void BackgroundTask::abandon() noexcept {
  if (!state_) return;
  if (!state_->claim()) state_->wait_for_end();
  state_->work = nullptr;
  state_.reset();
}

// std::thread::hardware_concurrency() counts the cores of the machine.
int available_cores() {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  if (::sched_getaffinity(0, sizeof cores, &cores) == 0) return std::max(1, CPU_COUNT(&cores));
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

ThreadPool::ThreadPool(int threads) : threads_(threads) {
  if (threads < 1) throw std::invalid_argument("ThreadPool: the number of threads must be at least 1");
  if (threads > 1) arena_ = std::make_shared<Arena>(threads);
}

void ThreadPool::parallel_for(int begin, int end, int grain, const std::function<void(int, int)>& body) const {
  if (grain < 1) throw std::invalid_argument("ThreadPool: the grain must be at least 1");
  if (end <= begin) return;
  const int parts = (end - begin + grain - 1) / grain;
  const auto run_part = [&](int part) {
    throw_if_cancelled();
    const int from = begin + part * grain;
    body(from, std::min(end, from + grain));
  };
  if (!arena_ || parts == 1) {
    for (int part = 0; part < parts; ++part) run_part(part);
    return;
  }
  arena_->workers.run(parts, run_part);
}

BackgroundTask ThreadPool::start(std::function<void()> work) const {
  BackgroundTask task;
  task.state_ = std::make_shared<BackgroundTask::State>(std::move(work));
  if (arena_) arena_->start(task.state_);
  return task;
}

void ThreadPool::parallel_for_parts(int parts, const std::function<void(int, int)>& body) const {
  std::atomic<int> next = 0;
  parallel_for(0, std::min(parts, threads_), 1, [&](int worker, int) {
    for (int part = next++; part < parts; part = next++) {
      throw_if_cancelled();
      body(part, worker);
    }
  });
}

void ThreadPool::parallel_invoke(const std::function<void()>& first, const std::function<void()>& second) const {
  const auto run = [&](const std::function<void()>& work) {
    throw_if_cancelled();
    work();
  };
  if (!arena_) {
    run(first);
    run(second);
    return;
  }
  arena_->workers.run(2, [&](int part) { run(part == 0 ? first : second); });
}

ThreadPool ThreadPool::cancellable() const {
  ThreadPool pool = *this;
  pool.cancelled_ = std::make_shared<std::atomic<bool>>(false);
  return pool;
}

void ThreadPool::cancel() const {
  if (!cancelled_) throw std::logic_error("ThreadPool: is not cancellable");
  *cancelled_ = true;
}

void ThreadPool::throw_if_cancelled() const {
  if (cancelled_ && *cancelled_) throw Cancelled();
}

}  // namespace spartan
