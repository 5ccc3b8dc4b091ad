#include "spartan/core/threads.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <atomic>
#include <mutex>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

namespace spartan {
namespace {

std::set<std::pair<int, int>> parts_of(const Workers& workers, int begin, int end, int grain) {
  std::mutex mutex;
  std::multiset<std::pair<int, int>> parts;
  workers.for_each_part(begin, end, grain, [&](int from, int to) {
    const std::lock_guard lock(mutex);
    parts.insert({from, to});
  });
  std::set<std::pair<int, int>> once(parts.begin(), parts.end());
  EXPECT_EQ(once.size(), parts.size()) << "a part ran twice";
  return once;
}

RC_GTEST_PROP(Workers, PartsCoverTheRangeOnceForAnyNumberOfThreads, ()) {
  const int begin = *rc::gen::inRange(-50, 50), length = *rc::gen::inRange(0, 200), grain = *rc::gen::inRange(1, 40);
  const auto alone = parts_of(Workers(1), begin, begin + length, grain);
  RC_ASSERT(parts_of(Workers(2), begin, begin + length, grain) == alone);
  int at = begin;
  for (const auto& [from, to] : alone) {
    RC_ASSERT(from == at);
    RC_ASSERT(to - from == std::min(grain, begin + length - from));
    at = to;
  }
  RC_ASSERT(at == begin + length);
}

TEST(Workers, RethrowExceptions) {
  for (const int threads : {1, 2}) {
    const Workers workers(threads);
    EXPECT_THROW(workers.for_each_part(0, 10, 1,
                                       [](int from, int) {
                                         if (from == 7) throw std::runtime_error("seven");
                                       }),
                 std::runtime_error);
    EXPECT_THROW(workers.run_both([] {}, [] { throw std::runtime_error("second"); }), std::runtime_error);
  }
}

TEST(Workers, RunBothFunctions) {
  for (const int threads : {1, 2}) {
    std::atomic<int> sum = 0;
    Workers(threads).run_both([&] { sum += 1; }, [&] { sum += 10; });
    EXPECT_EQ(sum, 11);
  }
}

TEST(Workers, NestWithoutDeadlock) {
  const Workers workers(2);
  std::atomic<int> count = 0;
  workers.for_each_part(0, 8, 1, [&](int, int) { workers.for_each_part(0, 8, 1, [&](int, int) { ++count; }); });
  EXPECT_EQ(count, 64);
}

TEST(Workers, RejectInvalidArguments) {
  EXPECT_THROW(Workers(0), std::invalid_argument);
  EXPECT_THROW(Workers(1).for_each_part(0, 1, 0, [](int, int) {}), std::invalid_argument);
}

}  // namespace
}  // namespace spartan
