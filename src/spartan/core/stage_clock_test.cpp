#include "spartan/core/stage_clock.h"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <new>
#include <string>
#include <thread>

namespace spartan {
namespace {

TEST(Stopwatch, ALapStartsWhereThePreviousOneEnded) {
  const auto start = std::chrono::steady_clock::now();
  Stopwatch watch;
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const double first = watch.lap(), second = watch.lap();
  const double all = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  EXPECT_GE(first, 5);
  EXPECT_GE(second, 0);
  EXPECT_LE(first + second, all);
}

TEST(StageClock, RecordsStagesInOrderAndReturnsTheirResults) {
  StageClock clock;
  EXPECT_EQ(clock.measure("first", [] { return 7; }), 7);
  clock.measure("second", [] { std::this_thread::sleep_for(std::chrono::milliseconds(2)); });
  clock.add({{"third", 1.5, 0.5}});
  const std::vector<StageTime> times = clock.take();
  ASSERT_EQ(times.size(), 3U);
  EXPECT_EQ(times[0].stage, "first");
  EXPECT_GE(times[1].wall_ms, 2);
  EXPECT_EQ(times[2].cpu_ms, 0.5);
  EXPECT_TRUE(clock.take().empty());
}

std::string stage_without_memory(const std::function<void()>& work) {
  try {
    work();
  } catch (const OutOfMemory& e) {
    return e.stage();
  }
  return "";
}

TEST(StageClock, AFailedAllocationNamesTheInnermostStage) {
  StageClock clock;
  EXPECT_EQ(stage_without_memory([&] { clock.measure("map", [] { throw std::bad_alloc(); }); }), "map");
  EXPECT_EQ(stage_without_memory([&] {
              clock.measure("slam", [&] { return clock.measure("match", []() -> int { throw std::bad_alloc(); }); });
            }),
            "match");
  EXPECT_TRUE(clock.take().empty()) << "a stage that fails has no time";
  EXPECT_EQ(out_of_memory(OutOfMemory("map")).what, "out of memory in the stage 'map'");
  EXPECT_EQ(out_of_memory(std::bad_alloc()).code, ErrorCode::resources);
}

}  // namespace
}  // namespace spartan
