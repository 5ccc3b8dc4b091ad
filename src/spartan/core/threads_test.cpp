#include "spartan/core/threads.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

namespace spartan {
namespace {

TEST(AvailableCores, AreThoseOfTheProcess) {
  cpu_set_t before, one;
  ASSERT_EQ(::sched_getaffinity(0, sizeof before, &before), 0);
  EXPECT_EQ(available_cores(), CPU_COUNT(&before));
  CPU_ZERO(&one);
  for (int core = 0; core < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++core) {
    if (CPU_ISSET(core, &before)) CPU_SET(core, &one);
  }
  ASSERT_EQ(::sched_setaffinity(0, sizeof one, &one), 0);
  EXPECT_EQ(available_cores(), 1);
  ASSERT_EQ(::sched_setaffinity(0, sizeof before, &before), 0);
}

std::set<std::pair<int, int>> parts_of(const ThreadPool& workers, int begin, int end, int grain) {
  std::mutex mutex;
  std::multiset<std::pair<int, int>> parts;
  workers.parallel_for(begin, end, grain, [&](int from, int to) {
    const std::lock_guard lock(mutex);
    parts.insert({from, to});
  });
  std::set<std::pair<int, int>> once(parts.begin(), parts.end());
  EXPECT_EQ(once.size(), parts.size()) << "a part ran twice";
  return once;
}

RC_GTEST_PROP(ThreadPool, PartsCoverTheRangeOnceForAnyNumberOfThreads, ()) {
  const int begin = *rc::gen::inRange(-50, 50), length = *rc::gen::inRange(0, 200), grain = *rc::gen::inRange(1, 40);
  const auto alone = parts_of(ThreadPool(1), begin, begin + length, grain);
  RC_ASSERT(parts_of(ThreadPool(2), begin, begin + length, grain) == alone);
  int at = begin;
  for (const auto& [from, to] : alone) {
    RC_ASSERT(from == at);
    RC_ASSERT(to - from == std::min(grain, begin + length - from));
    at = to;
  }
  RC_ASSERT(at == begin + length);
}

TEST(ThreadPool, EachPartRunsOnceAndWorkersDoNotShare) {
  for (const int threads : {1, 2, 3}) {
    for (const int parts : {0, 1, 2, 50}) {
      std::vector<std::atomic<int>> runs(static_cast<std::size_t>(parts));
      std::vector<std::atomic<int>> inside(static_cast<std::size_t>(std::min(threads, parts)));
      std::atomic<bool> shared = false;
      ThreadPool(threads).parallel_for_parts(parts, [&](int part, int worker) {
        std::atomic<int>& here = inside.at(static_cast<std::size_t>(worker));
        if (++here != 1) shared = true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        ++runs[static_cast<std::size_t>(part)];
        --here;
      });
      EXPECT_FALSE(shared);
      for (const std::atomic<int>& count : runs) EXPECT_EQ(count, 1);
    }
  }
}

TEST(ThreadPool, RethrowExceptions) {
  for (const int threads : {1, 2}) {
    const ThreadPool workers(threads);
    EXPECT_THROW(workers.parallel_for(0, 10, 1,
                                      [](int from, int) {
                                        if (from == 7) throw std::runtime_error("seven");
                                      }),
                 std::runtime_error);
    EXPECT_THROW(workers.parallel_invoke([] {}, [] { throw std::runtime_error("second"); }), std::runtime_error);
  }
}

TEST(ThreadPool, RunBothFunctions) {
  for (const int threads : {1, 2}) {
    std::atomic<int> sum = 0;
    ThreadPool(threads).parallel_invoke([&] { sum += 1; }, [&] { sum += 10; });
    EXPECT_EQ(sum, 11);
  }
}

TEST(ThreadPool, NestWithoutDeadlock) {
  const ThreadPool workers(2);
  std::atomic<int> count = 0;
  workers.parallel_for(0, 8, 1, [&](int, int) { workers.parallel_for(0, 8, 1, [&](int, int) { ++count; }); });
  EXPECT_EQ(count, 64);
}

TEST(BackgroundTask, RunsOnceBesideTheCaller) {
  for (const int threads : {1, 2}) {
    const ThreadPool workers(threads);
    for (int i = 0; i < 200; ++i) {
      int runs = 0;
      BackgroundTask task = workers.start([&] { ++runs; });
      workers.parallel_for(0, 4, 1, [](int, int) {});
      task.wait();
      task.wait();
      ASSERT_EQ(runs, 1);
      EXPECT_FALSE(task.empty());
    }
  }
}

TEST(BackgroundTask, RunsInWaitWithOneThread) {
  bool ran = false;
  BackgroundTask task = ThreadPool(1).start([&] { ran = true; });
  EXPECT_FALSE(ran);
  task.wait();
  EXPECT_TRUE(ran);
}

TEST(BackgroundTask, RethrowsAtEachWait) {
  for (const int threads : {1, 2}) {
    BackgroundTask task = ThreadPool(threads).start([] { throw std::runtime_error("in the background"); });
    EXPECT_THROW(task.wait(), std::runtime_error);
    EXPECT_THROW(task.wait(), std::runtime_error);
  }
}

TEST(BackgroundTask, IsFinishedOrNeverRunsAfterItsDestruction) {
  for (const int threads : {1, 2}) {
    const ThreadPool workers(threads);
    for (int i = 0; i < 200; ++i) {
      auto value = std::make_unique<int>(0);
      {
        BackgroundTask task = workers.start([&] { ++*value; });
        if (i % 2 == 0) task = {};
      }
      value.reset();  // an access after this is found by the address sanitizer
    }
  }
}

// Also where the queue of the pool still holds the task.
TEST(BackgroundTask, FreesWhatItsFunctionHoldsAtItsEnd) {
  for (const int threads : {1, 2}) {
    for (int i = 0; i < 200; ++i) {
      std::weak_ptr<ThreadPool> pool;
      BackgroundTask task;
      {
        auto workers = std::make_shared<ThreadPool>(threads);
        pool = workers;
        task = workers->start([workers] {});
        if (i % 3 == 0) std::this_thread::sleep_for(std::chrono::microseconds(200));  // a worker begins it
      }
      if (i % 2 == 0) task.wait();
      task = {};
      EXPECT_TRUE(pool.expired());
    }
  }
}

// The loops of the pool go on while a task runs in it.
TEST(BackgroundTask, LeavesTheLoopsOfThePoolRunning) {
  const ThreadPool workers(2);
  std::atomic<bool> stop = false;
  BackgroundTask task = workers.start([&] {
    while (!stop) std::this_thread::yield();
  });
  std::atomic<int> count = 0;
  for (int i = 0; i < 100; ++i) workers.parallel_for(0, 8, 1, [&](int, int) { ++count; });
  EXPECT_EQ(count, 800);
  stop = true;
  task.wait();
}

TEST(ThreadPool, CancelEndsTheLoopsOfItsCopiesAndOfNoOtherPool) {
  for (const int threads : {1, 2}) {
    const ThreadPool workers(threads), pool = workers.cancellable(), copy = pool;
    std::atomic<int> count = 0;
    const auto add = [&](int, int) { ++count; };
    pool.parallel_for(0, 4, 1, add);
    EXPECT_EQ(count, 4);
    EXPECT_THROW(copy.parallel_for(0, 1000, 1, [&](int, int) { pool.cancel(), ++count; }), Cancelled);
    EXPECT_LE(count, 4 + threads) << "parts that have begun";
    EXPECT_THROW(pool.parallel_for(0, 1, 1, add), Cancelled);
    EXPECT_THROW(pool.parallel_for_parts(1, add), Cancelled);
    EXPECT_THROW(pool.parallel_invoke([] {}, [] {}), Cancelled);
    count = 0;
    workers.parallel_for(0, 4, 1, add);
    EXPECT_EQ(count, 4);
  }
}

TEST(ThreadPool, RejectInvalidArguments) {
  EXPECT_THROW(ThreadPool(1).cancel(), std::logic_error);
  EXPECT_THROW(ThreadPool(0), std::invalid_argument);
  EXPECT_THROW(ThreadPool(1).parallel_for(0, 1, 0, [](int, int) {}), std::invalid_argument);
}

}  // namespace
}  // namespace spartan
