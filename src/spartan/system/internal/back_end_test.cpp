#include "spartan/system/internal/back_end.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <ostream>
#include <stdexcept>
#include <thread>
#include <vector>

namespace spartan::internal {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

// Who runs the jobs.
struct Runner {
  const char* name;
  int threads;
  bool own_thread;
  friend std::ostream& operator<<(std::ostream& out, const Runner& runner) { return out << runner.name; }
};

class BackEndTest : public ::testing::TestWithParam<Runner> {
 protected:
  BackEnd back_end_{ThreadPool(GetParam().threads), GetParam().own_thread};
};

TEST_P(BackEndTest, RunsJobsInTheirOrderOneAfterTheOther) {
  std::vector<int> order;
  std::atomic<int> running = 0;
  BackEnd::Ticket last = 0;
  for (int i = 0; i < 200; ++i) {
    const BackEnd::Ticket ticket = back_end_.submit("job", [&, i] {
      EXPECT_EQ(++running, 1);
      order.push_back(i);
      --running;
    });
    EXPECT_GT(ticket, last);
    last = ticket;
    if (i % 50 == 7) back_end_.wait(ticket);
  }
  back_end_.wait(last);
  EXPECT_TRUE(back_end_.is_done(last));
  EXPECT_EQ(back_end_.backlog(), 0U);
  ASSERT_EQ(order.size(), 200U);
  for (int i = 0; i < 200; ++i) EXPECT_EQ(order[static_cast<std::size_t>(i)], i);
}

TEST_P(BackEndTest, LoopsInsideAJobRunToTheirEnd) {
  std::atomic<int> sum = 0;
  const auto loop = [&] { back_end_.workers().parallel_for(0, 1000, 10, [&](int from, int to) { sum += to - from; }); };
  BackEnd::Ticket last = 0;
  for (int i = 0; i < 5; ++i) last = back_end_.submit("loop", loop);
  const ThreadPool front(GetParam().threads);
  front.parallel_for(0, 1000, 10, [&](int from, int to) { sum += to - from; });
  back_end_.wait(last);
  EXPECT_EQ(sum, 6000);
}

TEST_P(BackEndTest, RethrowsWhatAJobHasThrown) {
  const BackEnd::Ticket thrown = back_end_.submit("job", [] { throw std::runtime_error("no memory"); });
  EXPECT_THROW(back_end_.wait(thrown), std::runtime_error);
  EXPECT_THROW(back_end_.wait(thrown), std::runtime_error);
}

TEST_P(BackEndTest, JobsAfterOneThatHasThrownDoNotRun) {
  std::atomic<int> ran = 0;
  back_end_.submit("job", [&] { ++ran; });
  back_end_.submit("job", [] { throw std::runtime_error("no memory"); });
  const BackEnd::Ticket last = back_end_.submit("job", [&] { ++ran; });
  EXPECT_THROW(back_end_.wait(last), std::runtime_error);
  EXPECT_EQ(ran, 1);
}

TEST_P(BackEndTest, JobsThatHaveNotBegunNeverRunAfterItsEnd) {
  std::atomic<int> ran = 0;
  {
    BackEnd back_end(ThreadPool(GetParam().threads), GetParam().own_thread);
    for (int i = 0; i < 100; ++i) {
      back_end.submit("job", [&] {
        std::this_thread::sleep_for(1ms);
        ++ran;
      });
    }
  }
  EXPECT_LT(ran, 100);
}

TEST_P(BackEndTest, ItsEndCancelsTheLoopsOfTheJobThatHasBegun) {
  for (const bool one_thread : {false, true}) {
    std::atomic<bool> began = false;
    BackEnd back_end(ThreadPool(GetParam().threads), GetParam().own_thread);
    const ThreadPool& loops = one_thread ? back_end.one_thread() : back_end.workers();
    back_end.submit("job", [&] {
      for (began = true;;) loops.parallel_for(0, 100, 10, [](int, int) {});
    });
    // Where the caller runs the jobs, none begins without wait().
    while (!began && (GetParam().own_thread || GetParam().threads > 1)) std::this_thread::sleep_for(1ms);
  }
}

INSTANTIATE_TEST_SUITE_P(Runners, BackEndTest,
                         ::testing::Values(Runner{"Caller", 1, false}, Runner{"Worker", 2, false},
                                           Runner{"OwnThread", 1, true}, Runner{"OwnThreadBesideWorkers", 2, true}),
                         [](const auto& runner) { return runner.param.name; });

TEST(BackEndThread, RunsBesideItsCallerAtALowPriority) {
  BackEnd back_end(ThreadPool(1), true);
  std::atomic<int> niceness = -100;
  const int own = ::getpriority(PRIO_PROCESS, 0);
  const BackEnd::Ticket ticket =
      back_end.submit("job", [&] { niceness = ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid())); });
  while (!back_end.is_done(ticket)) std::this_thread::sleep_for(1ms);  // nobody waits for it
  EXPECT_EQ(niceness, std::min(own + BackEnd::kNiceness, 19));
  EXPECT_EQ(::getpriority(PRIO_PROCESS, 0), own);
}

}  // namespace
}  // namespace spartan::internal
