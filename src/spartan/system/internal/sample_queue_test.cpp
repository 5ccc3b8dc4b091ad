#include "spartan/system/internal/sample_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <deque>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "spartan/system/internal/queued_stream.h"
#include "spartan/testing/tiny_recordings.h"

namespace spartan::internal {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::size_t kFrameBytes = 2 * 24 * 16;

StreamRead read_of(Sample sample) {
  return {StreamRead::State::sample, std::move(sample), {}};
}

StreamRead frame_of(const std::string& pair, std::int64_t id) {
  StereoFrame frame;
  frame.frame_id = id;
  frame.pair = pair;
  frame.left_stamp = frame.right_stamp = Stamp{id};
  frame.left = FrameImage::own(testing::tiny_image(1), {});
  frame.right = FrameImage::own(testing::tiny_image(2), {});
  return read_of(std::move(frame));
}

// "narrow 1", "narrow 1 dropped", "imu 5", in the order of the queue.
std::vector<std::string> drain(SampleQueue& queue) {
  std::vector<std::string> all;
  for (;;) {
    const auto read = queue.pop(0s).value();
    if (read.state != StreamRead::State::sample) return all;
    if (const auto* frame = std::get_if<StereoFrame>(&*read.sample)) {
      all.push_back(frame->pair + " " + std::to_string(frame->frame_id));
    } else if (const auto* missing = std::get_if<MissingFrame>(&*read.sample)) {
      all.push_back(missing->pair + " " + std::to_string(missing->frame_id) + " " +
                    std::string(name_of(missing->fault)));
    } else {
      all.push_back("imu " + std::to_string(stamp_of(*read.sample).ns));
    }
  }
}

TEST(SampleQueue, KeepsTheOrderAndDropsNothingThatFits) {
  SampleQueue queue("narrow", 3 * kFrameBytes);
  queue.push(frame_of("narrow", 1));
  queue.push(read_of(ImuSample{Stamp{2}}));
  queue.push(frame_of("wide", 3));
  queue.push(frame_of("narrow", 4));
  EXPECT_EQ(queue.peak_bytes(), 3 * kFrameBytes);
  EXPECT_THAT(drain(queue), ElementsAre("narrow 1", "imu 2", "wide 3", "narrow 4"));
  EXPECT_EQ(queue.dropped().odometry + queue.dropped().views + queue.dropped().sensor_samples, 0);
}

TEST(SampleQueue, DropsTheOldestViewBeforeAnyFrameOfTheOdometry) {
  SampleQueue queue("narrow", 3 * kFrameBytes);
  queue.push(frame_of("narrow", 1));
  queue.push(frame_of("wide", 2));
  queue.push(frame_of("wide", 3));
  queue.push(frame_of("narrow", 4));
  queue.push(frame_of("narrow", 5));
  EXPECT_EQ(queue.dropped().views, 2);
  EXPECT_EQ(queue.dropped().odometry, 0);
  EXPECT_THAT(drain(queue), ElementsAre("narrow 1", "wide 2 dropped", "wide 3 dropped", "narrow 4", "narrow 5"));
}

TEST(SampleQueue, DropsTheOldestFrameOfTheOdometryWhereThereIsNoView) {
  SampleQueue queue("narrow", 2 * kFrameBytes);
  for (int id = 1; id <= 4; ++id) queue.push(frame_of("narrow", id));
  EXPECT_EQ(queue.dropped().odometry, 2);
  EXPECT_THAT(drain(queue), ElementsAre("narrow 1 dropped", "narrow 2 dropped", "narrow 3", "narrow 4"));
  queue.push(frame_of("narrow", 5));
  EXPECT_THAT(drain(queue), ElementsAre("narrow 5")) << "the bytes of what was dropped or taken are free again";
}

// What is taken too late: views first, and the order stays. Sensor samples are not dropped.
TEST(SampleQueue, DropsWhatHasWaitedForTooLong) {
  const auto now = std::chrono::steady_clock::now();
  const auto arrived = [&](StreamRead read, std::chrono::milliseconds before) {
    read.arrived = now - before;
    return read;
  };
  for (const bool limited : {true, false}) {
    SampleQueue queue("narrow", 100 * kFrameBytes, limited ? 1h : 0h);
    queue.push(arrived(frame_of("narrow", 1), 2h));
    queue.push(arrived(frame_of("wide", 2), 2h));
    queue.push(arrived(frame_of("narrow", 3), 2h));
    queue.push(arrived(read_of(ImuSample{Stamp{4}}), 2h));
    queue.push(arrived(frame_of("wide", 5), 1min));
    queue.push(arrived(frame_of("narrow", 6), 1min));
    if (limited) {
      EXPECT_THAT(drain(queue),
                  ElementsAre("narrow 1", "wide 2 dropped", "narrow 3", "imu 4", "wide 5 dropped", "narrow 6"));
      EXPECT_EQ(queue.dropped().views, 2);
      queue.push(arrived(frame_of("narrow", 7), 2h));
      queue.push(arrived(frame_of("narrow", 8), 1min));
      EXPECT_THAT(drain(queue), ElementsAre("narrow 7 dropped", "narrow 8"));
      EXPECT_EQ(queue.dropped().odometry, 1);
    } else {
      EXPECT_THAT(drain(queue), ElementsAre("narrow 1", "wide 2", "narrow 3", "imu 4", "wide 5", "narrow 6"));
    }
  }
}

// One camera of a pair is unplugged while processing cannot keep up.
TEST(SampleQueue, IsBoundedForFramesOfOneImage) {
  const auto one_image_of = [](const std::string& pair, std::int64_t id) {
    StereoFrame frame = std::get<StereoFrame>(*frame_of(pair, id).sample);
    frame.right = FrameImage();
    return read_of(MissingFrame{id, pair, frame.left_stamp, FrameFault::right_missing, "no right image", frame});
  };
  SampleQueue queue("narrow", 2 * kFrameBytes);
  for (int id = 1; id <= 8; ++id) queue.push(one_image_of("narrow", id));
  queue.push(one_image_of("wide", 9));
  queue.push(frame_of("narrow", 10));
  EXPECT_LE(queue.peak_bytes(), 2 * kFrameBytes);
  EXPECT_EQ(queue.dropped().views, 1);
  EXPECT_EQ(queue.dropped().odometry, 6);
  for (int id = 1; id <= 9; ++id) {
    const auto read = queue.pop(0s).value();
    const auto& missing = std::get<MissingFrame>(*read.sample);
    EXPECT_EQ(missing.frame_id, id);
    EXPECT_EQ(missing.fault, FrameFault::right_missing);
    EXPECT_EQ(missing.partial.has_value(), id == 7 || id == 8) << id;
    EXPECT_THAT(missing.message, HasSubstr(missing.partial ? "no right image" : "the other image was dropped"));
  }
  EXPECT_THAT(drain(queue), ElementsAre("narrow 10")) << "a frame of both images is newer";
}

TEST(SampleQueue, DropsTheOldestSensorSamplesBeyondTheirNumber) {
  SampleQueue queue("narrow", kFrameBytes);
  queue.push(frame_of("narrow", 0));
  for (std::size_t i = 1; i <= SampleQueue::kMostSensorSamples + 2; ++i)
    queue.push(read_of(ImuSample{Stamp{static_cast<std::int64_t>(i)}}));
  EXPECT_EQ(queue.dropped().sensor_samples, 2);
  const auto rest = drain(queue);
  EXPECT_EQ(rest.front(), "narrow 0");
  EXPECT_EQ(rest[1], "imu 3");
}

TEST(SampleQueue, ReportsTheEndAfterAllSamples) {
  SampleQueue queue("narrow", kFrameBytes);
  queue.push(frame_of("narrow", 1));
  queue.close(failure(ErrorCode::read_error, "cable pulled"));
  EXPECT_EQ(queue.pop(0s)->state, StreamRead::State::sample);
  EXPECT_THAT(queue.pop(0s).error().what, HasSubstr("cable"));
  SampleQueue ended("narrow", kFrameBytes);
  EXPECT_EQ(ended.pop(0s)->state, StreamRead::State::none_yet);
  ended.close({});
  EXPECT_EQ(ended.pop(1h)->state, StreamRead::State::end);
}

// Delivers `frames` frames 2 ms apart, then the end.
class TickingStream : public SampleStream {
 public:
  explicit TickingStream(int frames) : frames_(frames) {}
  const StreamInfo& info() const override { return info_; }
  Result<StreamRead> read(std::chrono::nanoseconds /*timeout*/) override {
    if (next_ == frames_) return StreamRead{};
    std::this_thread::sleep_for(2ms);
    auto read = frame_of("narrow", next_++);
    read.arrived = std::chrono::steady_clock::now();
    return read;
  }
  std::size_t previews(const std::string& /*pair*/) const override { return 0; }
  Result<StereoFrame> preview(const std::string& pair, std::size_t /*index*/) override {
    return failure(ErrorCode::input, "no preview", pair);
  }

 private:
  StreamInfo info_;
  int frames_, next_ = 0;
};

TEST(QueuedStream, ReadsAllOnItsOwnThread) {
  TickingStream ticking(20);
  QueuedStream stream(ticking, "narrow", 100 * kFrameBytes);
  int frames = 0;
  for (;;) {
    const auto read = stream.read(1s).value();
    if (read.state == StreamRead::State::end) break;
    if (frames == 0) std::this_thread::sleep_for(100ms);  // the others arrive meanwhile
    ++frames;
  }
  EXPECT_EQ(frames, 20);
  EXPECT_GT(stream.peak_bytes(), 10 * kFrameBytes);
}

TEST(QueuedStream, CanBeStoppedAtAnyTime) {
  TickingStream ticking(1'000'000);
  {
    QueuedStream stream(ticking, "narrow", 10 * kFrameBytes);
    EXPECT_TRUE(stream.read(1s));
  }
  TickingStream never_read(1);
  const QueuedStream unused(never_read, "narrow", kFrameBytes);
}

}  // namespace
}  // namespace spartan::internal
