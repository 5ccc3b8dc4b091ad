#include "spartan/system/internal/watchdog.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>

namespace spartan::internal {
namespace {

using namespace std::chrono_literals;

TEST(Watchdog, NamesTheStageThatHangs) {
  RunningStage front_end, back_end;
  std::atomic<int> calls = 0;
  std::string named;
  double after_s = 0;
  const Watchdog watchdog({{&front_end, 0.15}, {&back_end, 0.3}}, [&](const std::string& stage, double seconds) {
    named = stage;
    after_s = seconds;
    ++calls;
  });
  StageClock clock;
  clock.show_in(front_end);
  back_end.begin("map of a stop");
  // Each of these is short.
  for (int i = 0; i < 10; ++i) clock.measure("odometry", [] { std::this_thread::sleep_for(20ms); });
  while (calls == 0) std::this_thread::sleep_for(5ms);
  EXPECT_EQ(named, "map of a stop");
  EXPECT_GE(after_s, 0.3);
  std::this_thread::sleep_for(250ms);
  EXPECT_EQ(calls, 1) << "it calls once";
}

TEST(Watchdog, IsSilentWhereNothingHangs) {
  RunningStage stage;
  std::atomic<int> calls = 0;
  {
    const Watchdog watchdog({{&stage, 0.25}}, [&](const std::string&, double) { ++calls; });
    StageClock clock;
    clock.show_in(stage);
    for (int i = 0; i < 4; ++i) {
      clock.measure("imaging", [] { std::this_thread::sleep_for(100ms); });
      std::this_thread::sleep_for(50ms);
    }
    std::this_thread::sleep_for(400ms);
  }
  EXPECT_EQ(calls, 0) << "between the stages nothing runs";
}

TEST(RunningStage, StagesMayBeNested) {
  RunningStage running;
  EXPECT_EQ(running.stage(), nullptr);
  StageClock outer, inner;
  outer.show_in(running);
  inner.show_in(running);
  outer.measure("front end", [&] {
    inner.measure("odometry", [&] { EXPECT_STREQ(running.stage(), "odometry"); });
    EXPECT_STREQ(running.stage(), "front end");
    EXPECT_THROW(inner.measure("imaging", [] { throw std::runtime_error("x"); }), std::runtime_error);
    EXPECT_STREQ(running.stage(), "front end");
  });
  EXPECT_EQ(running.stage(), nullptr);
}

}  // namespace
}  // namespace spartan::internal
