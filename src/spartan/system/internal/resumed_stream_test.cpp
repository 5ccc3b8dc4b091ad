// ResumedStream: what was recorded before, then the live stream.
#include "spartan/system/internal/resumed_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "spartan/camera/recording_writer.h"
#include "spartan/testing/temporary_folder.h"
#include "spartan/testing/tiny_recordings.h"

namespace spartan::internal {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

constexpr std::size_t kTinyQueueBytes = std::size_t{1} << 20U;

// The number of a frame of the whole run is that of its stamp.
Stamp stamp_of_number(int number) {
  return Stamp{1'000'000'000LL * (number + 1)};
}

StereoFrame numbered_frame(int number, int frame_id) {
  StereoFrame frame;
  frame.frame_id = frame_id;
  frame.pair = "stereo";
  frame.left_stamp = frame.right_stamp = stamp_of_number(number);
  frame.left = FrameImage::own(testing::tiny_image(static_cast<std::uint64_t>(2 * number)), {});
  frame.right = FrameImage::own(testing::tiny_image(static_cast<std::uint64_t>(2 * number + 1)), {});
  return frame;
}

// Delivers frames from a number on, counts them from 0, and has only one image of the last one.
class CountingCamera : public SampleStream {
 public:
  CountingCamera(int first, int frames) : first_(first), frames_(frames) { info_.rig = testing::tiny_rig(); }
  const StreamInfo& info() const override { return info_; }
  Result<StreamRead> read(std::chrono::nanoseconds /*timeout*/) override {
    if (next_ == frames_) return StreamRead{};
    StereoFrame frame = numbered_frame(first_ + next_, next_);
    if (++next_ < frames_) return StreamRead{StreamRead::State::sample, std::move(frame), {}};
    MissingFrame missing{frame.frame_id, frame.pair, frame.left_stamp, FrameFault::left_missing, "no image", {}};
    frame.left = FrameImage();
    missing.partial = std::move(frame);
    return StreamRead{StreamRead::State::sample, std::move(missing), {}};
  }
  std::size_t previews(const std::string& /*pair*/) const override { return 0; }
  Result<StereoFrame> preview(const std::string& pair, std::size_t /*index*/) override {
    return failure(ErrorCode::input, "no preview", pair);
  }

 private:
  StreamInfo info_;
  int first_, frames_, next_ = 0;
};

class ResumedStreamTest : public ::testing::Test {
 protected:
  std::string recording(int number) const { return folder_.path() + "/" + std::to_string(number); }

  // A run that is resumed after frame `processed` (−1: that begins) and records what comes. Returns the numbers that
  // the frames have.
  std::vector<std::int64_t> execute(int processed, int first, int frames) {
    std::vector<std::unique_ptr<Recording>> recorded;
    for (int i = 1; i <= executions_; ++i) recorded.push_back(open_recording(recording(i)).value());
    CountingCamera camera(first, frames);
    QueuedStream queue(camera, "stereo", kTinyQueueBytes);
    queue.record_with(StreamRecorder::create(recording(++executions_), camera.info(), ImageFiles::pnm).value());
    ResumedStream stream(std::move(recorded), queue);
    if (processed >= 0) stream.skip_until({{"stereo", stamp_of_number(processed)}}, processed);
    std::vector<std::int64_t> ids;
    for (auto read = stream.read(1s); read && read->state != StreamRead::State::end; read = stream.read(1s)) {
      if (!read->sample) continue;
      const auto* const missing = std::get_if<MissingFrame>(&*read->sample);
      const StereoFrame& frame = missing != nullptr ? *missing->partial : std::get<StereoFrame>(*read->sample);
      EXPECT_EQ(missing != nullptr ? missing->frame_id : frame.frame_id, frame.frame_id);
      EXPECT_EQ(frame.left_stamp, stamp_of_number(static_cast<int>(frame.frame_id)));
      ids.push_back(frame.frame_id);
    }
    queue.stop();
    EXPECT_TRUE(queue.recorder()->finish());
    return ids;
  }

  testing::TemporaryFolder folder_;
  int executions_ = 0;
};

TEST_F(ResumedStreamTest, NumbersGoOnAfterEachResume) {
  EXPECT_THAT(execute(-1, 0, 5), ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(execute(2, 5, 4), ElementsAre(3, 4, 5, 6, 7, 8));
  EXPECT_THAT(execute(6, 9, 2), ElementsAre(7, 8, 9, 10));
  EXPECT_THAT(execute(10, 11, 2), ElementsAre(11, 12)) << "all that was recorded was processed";
}

TEST_F(ResumedStreamTest, NumbersGoOnWithoutARecording) {
  EXPECT_THAT(execute(-1, 0, 5), ElementsAre(0, 1, 2, 3, 4));
  std::filesystem::remove_all(recording(1));
  executions_ = 0;
  EXPECT_THAT(execute(4, 5, 2), ElementsAre(5, 6));
}

// Reading these images fails: those of hours would be many GB.
TEST_F(ResumedStreamTest, SkipsWhatWasProcessedWithoutItsImages) {
  constexpr int kFrames = 40, kProcessed = 30;
  {
    auto writer = RecordingWriter::create(recording(1), testing::tiny_rig(), {}).value();
    for (int i = 0; i < kFrames; ++i) ASSERT_TRUE(writer.add(numbered_frame(i, i)));
    ASSERT_TRUE(writer.finish());
  }
  std::vector<std::unique_ptr<Recording>> recorded;
  recorded.push_back(open_recording(recording(1)).value());
  for (int i = 0; i <= kProcessed; ++i) {
    const std::string image = recording(1) + "/images/stereo/" + std::to_string(stamp_of_number(i).ns) + "_left.png";
    std::filesystem::remove(image);
    std::filesystem::create_symlink("/proc/self/mem", image);
  }
  CountingCamera camera(kFrames, 1);
  QueuedStream queue(camera, "stereo", kTinyQueueBytes);
  ResumedStream stream(std::move(recorded), queue);
  stream.skip_until({{"stereo", stamp_of_number(kProcessed)}}, kProcessed);
  int waits = 0;
  std::vector<std::int64_t> ids;
  while (stream.is_catching_up()) {
    const auto read = stream.read(0ns);
    ASSERT_TRUE(read) << read.error().message();
    waits += read->state == StreamRead::State::none_yet;
    if (read->sample) {
      if (const auto* frame = std::get_if<StereoFrame>(&*read->sample)) ids.push_back(frame->frame_id);
    }
  }
  EXPECT_GE(waits, kProcessed) << "a run can be stopped meanwhile";
  EXPECT_THAT(ids, ElementsAre(31, 32, 33, 34, 35, 36, 37, 38, 39));
}

}  // namespace
}  // namespace spartan::internal
