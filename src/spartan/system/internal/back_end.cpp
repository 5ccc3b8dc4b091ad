#include "spartan/system/internal/back_end.h"

#include <sys/resource.h>
#include <unistd.h>

#include <utility>

namespace spartan::internal {
namespace {

// On Linux the nice value is that of a thread. Where the system does not allow it, the thread runs like the others.
void lower_priority(int by) {
  const auto thread = static_cast<id_t>(::gettid());
  static_cast<void>(::setpriority(PRIO_PROCESS, thread, ::getpriority(PRIO_PROCESS, thread) + by));
}

}  // namespace

BackEnd::BackEnd(const ThreadPool& workers, bool own_thread)
    : pool_(workers),
      loops_((own_thread ? ThreadPool(1) : workers).cancellable()),
      one_thread_(ThreadPool(1).cancellable()),
      own_thread_(own_thread) {}

BackEnd::Ticket BackEnd::submit(const char* name, std::function<void()> job) {
  const Lock lock(mutex_);
  jobs_.push_back({name, std::move(job)});
  if (own_thread_ && !thread_.joinable()) thread_ = std::thread([this] { run_thread(); });
  if (!own_thread_) start_pump();
  changed_.notify_all();
  return ++submitted_;
}

bool BackEnd::is_done(Ticket ticket) const {
  const Lock lock(mutex_);
  return finished_ >= ticket;
}

std::uint64_t BackEnd::backlog() const {
  const Lock lock(mutex_);
  return submitted_ - finished_;
}

// With the lock, which it releases while the job runs.
void BackEnd::run_next(Lock& lock) {
  const Job job = std::move(jobs_.front());
  jobs_.pop_front();
  busy_ = true;
  const bool failed = error_ != nullptr;  // a job before: this one may build on what that has left unfinished
  lock.unlock();
  std::exception_ptr error;
  running_.begin(job.name);
  try {
    if (!failed) job.work();
  } catch (...) {  // none is lost: wait() rethrows it in the thread that needs the result
    error = std::current_exception();
  }
  running_.end(nullptr);
  lock.lock();
  busy_ = false;
  ++finished_;
  if (error && !error_) error_ = error;
  changed_.notify_all();
}

void BackEnd::wait(Ticket ticket) {
  Lock lock(mutex_);
  ++waiting_;  // the pump leaves the next job to this thread
  while (finished_ < ticket && !stopped_) {
    if (!own_thread_ && can_run()) {
      run_next(lock);
    } else {
      changed_.wait(lock, [&] { return finished_ >= ticket || stopped_ || (!own_thread_ && can_run()); });
    }
  }
  --waiting_;
  if (!own_thread_) start_pump();
  if (error_) std::rethrow_exception(error_);
}

// With the lock. A pool of one thread has no worker.
void BackEnd::start_pump() {
  if (pumping_ || !can_run() || waiting_ > 0 || pool_.threads() == 1) return;
  pumping_ = true;
  pump_task_ = pool_.start([this] { pump(); });
}

void BackEnd::pump() {
  Lock lock(mutex_);
  while (can_run() && waiting_ == 0) run_next(lock);
  pumping_ = false;
}

void BackEnd::run_thread() {
  lower_priority(kNiceness);
  Lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return stopped_ || can_run(); });
    if (stopped_) return;
    run_next(lock);
  }
}

void BackEnd::stop() {
  {
    const Lock lock(mutex_);
    stopped_ = true;
    jobs_.clear();
    changed_.notify_all();
  }
  loops_.cancel();
  one_thread_.cancel();
  if (thread_.joinable()) thread_.join();
  pump_task_ = {};
}

}  // namespace spartan::internal
