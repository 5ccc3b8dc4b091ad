#include "spartan/camera/internal/sensor_line_stream.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <variant>

#include "spartan/testing/temporary_folder.h"

namespace spartan::internal {
namespace {

using namespace std::chrono_literals;

// Cameras with an image each time that they are asked, or none.
class FakeCameras : public SampleStream {
 public:
  explicit FakeCameras(bool have_images) : have_images_(have_images) {}
  const StreamInfo& info() const override { return info_; }
  Result<StreamRead> read(std::chrono::nanoseconds timeout) override {
    const auto now = std::chrono::steady_clock::now();
    if (have_images_) return StreamRead{StreamRead::State::sample, StereoFrame{}, now};
    std::this_thread::sleep_for(timeout);
    return StreamRead{StreamRead::State::none_yet, {}, now};
  }
  std::size_t previews(const std::string&) const override { return 3; }
  Result<StereoFrame> preview(const std::string&, std::size_t) override { return StereoFrame{}; }

 private:
  StreamInfo info_;
  bool have_images_;
};

class SensorLineStreamTest : public ::testing::Test {
 protected:
  std::unique_ptr<SampleStream> open(bool have_images) {
    auto lines = SensorLineReader::open(path_, Eigen::Quaterniond::Identity(), HostClock()).value();
    return std::make_unique<SensorLineStream>(std::make_unique<FakeCameras>(have_images), std::move(lines));
  }
  void write(std::string_view text) {
    const int file = ::open(path_.c_str(), O_WRONLY | O_NONBLOCK);
    ASSERT_GE(file, 0);
    ASSERT_EQ(::write(file, text.data(), text.size()), static_cast<ssize_t>(text.size()));
    ::close(file);
  }
  testing::TemporaryFolder folder_;
  std::string path_ = folder_.path() + "/sensors";
};

TEST_F(SensorLineStreamTest, LinesBecomeSamples) {
  const auto stream = open(false);
  EXPECT_EQ(stream->read(5ms)->state, StreamRead::State::none_yet);
  EXPECT_EQ(stream->read(0ms)->state, StreamRead::State::none_yet);
  write("wheels,,1,2\nimu,,0,0,0,0,0,9.8\n");
  EXPECT_EQ(std::get<WheelSample>(*stream->read(10s)->sample).right_m, 2);
  EXPECT_EQ(std::get<ImuSample>(*stream->read(10s)->sample).accel_m_s2.z(), 9.8);
  EXPECT_EQ(stream->read(5ms)->state, StreamRead::State::none_yet);
  write("noise\nwheels,,1,3\n");  // another writer
  EXPECT_EQ(std::get<WheelSample>(*stream->read(10s)->sample).right_m, 3);
  EXPECT_EQ(stream->discarded().unreadable, 1);
  EXPECT_EQ(stream->previews("stereo"), 3U);
}

// The run is prepared, or catches up with its recording.
TEST_F(SensorLineStreamTest, LinesHaveTheTimeOfTheirArrivalHoweverLateTheyAreRead) {
  const auto stream = open(false);
  const HostClock clock;
  const Stamp before = clock.now();
  write("wheels,,1,2\n");
  std::this_thread::sleep_for(100ms);
  write("wheels,,1,3\n");
  std::this_thread::sleep_for(300ms);
  const Stamp first = stamp_of(*stream->read(10s)->sample), second = stamp_of(*stream->read(10s)->sample);
  EXPECT_GE(seconds_between(before, first), 0);
  EXPECT_GE(seconds_between(first, second), 0.05);
  EXPECT_GE(seconds_between(second, clock.now()), 0.15);
}

// Neither waits for the other, however much of it there is.
TEST_F(SensorLineStreamTest, ImagesAndLinesTakeTurns) {
  const auto stream = open(true);
  const std::int64_t begin = HostClock().now().ns;
  std::string lines;
  for (int i = 0; i < 100; ++i) lines += "wheels," + std::to_string(begin + i) + ",1,2\n";
  write(lines);
  int images = 0, samples = 0;
  while (samples < 100) {
    auto read = stream->read(10ms).value();
    ASSERT_EQ(read.state, StreamRead::State::sample);
    ++(std::holds_alternative<StereoFrame>(*read.sample) ? images : samples);
  }
  EXPECT_GE(images, 99);
}

TEST_F(SensorLineStreamTest, AFileIsNoFifo) {
  folder_.write("sensors", "imu\n");
  const auto reader = SensorLineReader::open(path_, Eigen::Quaterniond::Identity(), HostClock());
  ASSERT_FALSE(reader);
  EXPECT_EQ(reader.error().code, ErrorCode::output);
}

}  // namespace
}  // namespace spartan::internal
