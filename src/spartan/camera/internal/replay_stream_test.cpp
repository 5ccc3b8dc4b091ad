#include "spartan/camera/internal/replay_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "spartan/testing/temporary_folder.h"
#include "spartan/testing/tiny_recordings.h"

namespace spartan::internal {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using testing::TemporaryFolder;

// A clock that advances only where somebody waits.
class ManualClock {
 public:
  ReplayClock functions() {
    return {[this] { return now; }, [this](ReplayClock::Time time) { now = std::max(now, time); }};
  }
  ReplayClock::Time now{1h};
};

class ReplayStreamTest : public ::testing::Test {
 protected:
  // Three frames 0.1 s apart, two readings of the wheels.
  ReplayStreamTest() {
    testing::write_tiny_spartan(folder_, 3, 0.1);
    folder_.write("sensors/wheels.csv", "stamp_ns,left_m,right_m\n0,0,0\n150000000,0.5,0.6\n");
  }
  ReplayStream open(double speed, int passes = 1) {
    return {open_recording(folder_.path()).value(), speed, passes, clock_.functions()};
  }
  // All samples; reads until the end.
  std::vector<StreamRead> read_all(ReplayStream& stream, std::chrono::nanoseconds timeout = 10s) {
    std::vector<StreamRead> reads;
    for (;;) {
      auto read = stream.read(timeout).value();
      if (read.state == StreamRead::State::end) return reads;
      reads.push_back(std::move(read));
    }
  }
  static std::vector<double> arrivals_s(const std::vector<StreamRead>& reads) {
    std::vector<double> seconds;
    seconds.reserve(reads.size());
    for (const StreamRead& read : reads)
      seconds.push_back(std::chrono::duration<double>(read.arrived - reads.front().arrived).count());
    return seconds;
  }

  TemporaryFolder folder_;
  ManualClock clock_;
};

TEST_F(ReplayStreamTest, SamplesArriveAtThePaceOfTheirStamps) {
  ReplayStream stream = open(1);
  EXPECT_THAT(arrivals_s(read_all(stream)), ElementsAre(0, 0, 0.1, 0.15, 0.2));
  ReplayStream fast = open(4);
  EXPECT_THAT(arrivals_s(read_all(fast)), ElementsAre(0, 0, 0.025, 0.0375, 0.05));
}

TEST_F(ReplayStreamTest, ReadReturnsAfterItsTimeoutWhereNoSampleIsDue) {
  ReplayStream stream = open(1);
  stream.read(10s).value();
  stream.read(10s).value();
  std::this_thread::sleep_for(200ms);  // the others are decoded meanwhile
  const auto before = clock_.now;
  EXPECT_EQ(stream.read(30ms)->state, StreamRead::State::none_yet);
  EXPECT_EQ(clock_.now - before, 30ms);
  const auto read = stream.read(100ms).value();
  EXPECT_EQ(read.state, StreamRead::State::sample);
  EXPECT_EQ(clock_.now - before, 100ms) << "the time at which it is due, not that of the timeout";
}

TEST_F(ReplayStreamTest, ASampleThatIsReadLateArrivesWhenItIsRead) {
  ReplayStream stream = open(1);
  const auto first = stream.read(1s).value();
  stream.read(1s).value();
  clock_.now += 170ms;
  EXPECT_EQ(stream.read(1s)->arrived - first.arrived, 170ms);
  EXPECT_EQ(stream.read(1s)->arrived - first.arrived, 170ms);
  EXPECT_EQ(stream.read(1s)->arrived - first.arrived, 200ms) << "the lateness does not add up";
}

TEST_F(ReplayStreamTest, SeveralPassesGoOnInTimeNumberAndDistance) {
  ReplayStream stream = open(1, 3);
  std::vector<std::int64_t> ids, stamps_ms;
  std::vector<double> left_m;
  for (const StreamRead& read : read_all(stream)) {
    if (const auto* frame = std::get_if<StereoFrame>(&*read.sample)) {
      ids.push_back(frame->frame_id);
      stamps_ms.push_back(frame->left_stamp.ns / 1'000'000);
    } else {
      left_m.push_back(std::get<WheelSample>(*read.sample).left_m);
    }
  }
  EXPECT_THAT(ids, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_THAT(stamps_ms, ElementsAre(0, 100, 200, 300, 400, 500, 600, 700, 800));
  EXPECT_THAT(left_m, ElementsAre(0, 0.5, 0.5, 1, 1, 1.5));
}

// As those of a rover that has driven before.
TEST_F(ReplayStreamTest, DistancesOfWheelsGoOnWhateverTheyBeginWith) {
  folder_.write("sensors/wheels.csv", "stamp_ns,left_m,right_m\n0,7,8\n150000000,7.5,8.75\n");
  ReplayStream stream = open(1, 3);
  std::vector<double> left_m, right_m;
  for (const StreamRead& read : read_all(stream)) {
    const auto* const wheels = std::get_if<WheelSample>(&*read.sample);
    if (wheels == nullptr) continue;
    left_m.push_back(wheels->left_m);
    right_m.push_back(wheels->right_m);
  }
  EXPECT_THAT(left_m, ElementsAre(7, 7.5, 7.5, 8, 8, 8.5));
  EXPECT_THAT(right_m, ElementsAre(8, 8.75, 8.75, 9.5, 9.5, 10.25));
}

TEST_F(ReplayStreamTest, WhileItSkipsItCanBeLeft) {
  ReplayStream stream = open(1, 1'000'000'000);
  stream.start_after(Stamp::from_seconds(1e9));
  EXPECT_EQ(stream.read(10ms)->state, StreamRead::State::none_yet);
}

TEST_F(ReplayStreamTest, PreviewsDoNotStartTheClock) {
  ReplayStream stream = open(1);
  EXPECT_EQ(stream.previews("stereo"), 3U);
  EXPECT_EQ(stream.preview("stereo", 2)->frame_id, 2);
  clock_.now += 5s;
  EXPECT_EQ(read_all(stream).front().arrived, ReplayClock::Time(1h + 5s));
}

TEST(LiveAddress, OpensAReplayAndNamesWhatItIsNot) {
  const TemporaryFolder folder;
  testing::write_tiny_kitti(folder, 2);
  EXPECT_FALSE(is_live_address(folder.path()));
  const std::string address = "replay:" + folder.path();
  ASSERT_TRUE(is_live_address(address));
  const auto stream = open_live_stream(address, {}, {});
  ASSERT_TRUE(stream);
  EXPECT_EQ((*stream)->info().path, address);
  EXPECT_EQ(open_live_stream(folder.path(), {}, {}).error().code, ErrorCode::usage);
  EXPECT_EQ(open_live_stream(address, {}, {0, 1}).error().code, ErrorCode::usage);
  EXPECT_EQ(open_live_stream("replay:/nowhere", {}, {}).error().code, ErrorCode::input);
}

}  // namespace
}  // namespace spartan::internal
