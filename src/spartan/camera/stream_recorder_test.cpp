// RecordingWriter in batches, and StreamRecorder.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/camera/recording_writer.h"
#include "spartan/core/files.h"
#include "spartan/image_io/image_io.h"
#include "spartan/testing/temporary_folder.h"
#include "spartan/testing/tiny_recordings.h"

namespace spartan {
namespace {

using namespace std::chrono_literals;
using testing::TemporaryFolder;
using testing::tiny_image;
using testing::tiny_rig;

StereoFrame tiny_frame(int i) {
  StereoFrame frame;
  frame.frame_id = i;
  frame.pair = "stereo";
  frame.left_stamp = frame.right_stamp = Stamp{100'000'000LL * (i + 1)};
  frame.left = FrameImage::own(tiny_image(static_cast<std::uint64_t>(2 * i)), {});
  frame.right = FrameImage::own(tiny_image(static_cast<std::uint64_t>(2 * i + 1)), {});
  return frame;
}

StreamInfo tiny_stream() {
  StreamInfo info;
  info.rig = tiny_rig();
  info.name = "drive";
  info.gravity_m_s2 = 3.71;
  return info;
}

// Rows of frames.csv without its header.
std::size_t listed_frames(const std::string& folder) {
  const std::string table = read_file(folder + "/frames.csv").value();
  return static_cast<std::size_t>(std::count(table.begin(), table.end(), '\n')) - 1;
}

TEST(StreamRecorder, StoresSelfMasksWithTheRecording) {
  const TemporaryFolder folder;
  StreamInfo info = tiny_stream();
  info.rig_source = folder.path() + "/rig.yaml";
  info.rig.cameras[0].self_mask = "rover.pgm";
  const std::string path = folder.path() + "/recording";
  EXPECT_EQ(StreamRecorder::create(path, info, ImageFiles::pnm).error().code, ErrorCode::configuration);
  static_cast<void>(folder.write("rover.pgm", "P5 1 1 255\n\xff"));
  auto recorder = StreamRecorder::create(folder.path() + "/again", info, ImageFiles::pnm);
  ASSERT_TRUE(recorder) << recorder.error().message();
  ASSERT_TRUE((*recorder)->finish());
  const Rig stored = read_rig_yaml(folder.path() + "/again/rig.yaml").value();
  EXPECT_EQ(read_file(folder.path() + "/again/" + stored.cameras[0].self_mask).value(), "P5 1 1 255\n\xff");
}

class StreamRecorderTest : public ::testing::TestWithParam<ImageFiles> {
 protected:
  std::string path() const { return folder_.path() + "/recording"; }
  TemporaryFolder folder_;
};

TEST_P(StreamRecorderTest, RecordsWhatCanBeReadBack) {
  {
    const auto recorder = StreamRecorder::create(path(), tiny_stream(), GetParam()).value();
    for (int i = 0; i < 5; ++i) {
      recorder->add(tiny_frame(i));
      recorder->add(WheelSample{Stamp{100'000'000LL * (i + 1) + 1}, 0.1 * i, 0.2 * i});
    }
    recorder->add(MissingFrame{});
    ASSERT_TRUE(recorder->finish());
    EXPECT_EQ(recorder->progress().frames, 5);
    EXPECT_EQ(recorder->progress().sensor_samples, 5);
    EXPECT_EQ(recorder->progress().dropped + recorder->progress().rejected, 0);
  }
  const auto recording = open_recording(path()).value();
  EXPECT_EQ(recording->info().name, "drive");
  EXPECT_EQ(recording->info().gravity_m_s2, 3.71);
  const auto samples = testing::collect_samples(*recording);
  EXPECT_EQ(samples.error, "");
  EXPECT_EQ(samples.all.size(), 10U);
  ASSERT_EQ(samples.frames.size(), 5U);
  for (int i = 0; i < 5; ++i) {
    const StereoFrame expected = tiny_frame(i), &read = samples.frames[static_cast<std::size_t>(i)];
    EXPECT_EQ(read.frame_id, i);
    EXPECT_TRUE(testing::same_image(read.left, expected.left));
    EXPECT_TRUE(testing::same_image(read.right, expected.right));
  }
}

TEST_P(StreamRecorderTest, FramesOfOneImageAreReadBackAsSuch) {
  {
    const auto recorder = StreamRecorder::create(path(), tiny_stream(), GetParam()).value();
    recorder->add(tiny_frame(0));
    MissingFrame missing;
    missing.pair = "stereo";
    missing.partial = tiny_frame(1);
    missing.stamp = missing.partial->left_stamp;
    missing.partial->left = FrameImage();
    recorder->add(missing);
    ASSERT_TRUE(recorder->finish());
    EXPECT_EQ(recorder->progress().frames, 2);
  }
  const auto recording = open_recording(path()).value();
  ASSERT_TRUE(std::holds_alternative<StereoFrame>(*recording->next().value()));
  const Sample second = *recording->next().value();
  const auto* missing = std::get_if<MissingFrame>(&second);
  ASSERT_NE(missing, nullptr);
  ASSERT_TRUE(missing->partial);
  EXPECT_EQ(missing->stamp, tiny_frame(1).left_stamp);
  EXPECT_TRUE(missing->partial->left.empty());
  EXPECT_TRUE(testing::same_image(missing->partial->right, tiny_frame(1).right));
}

INSTANTIATE_TEST_SUITE_P(ImageFiles, StreamRecorderTest, ::testing::Values(ImageFiles::png, ImageFiles::pnm),
                         [](const auto& files) { return files.param == ImageFiles::png ? "Png" : "Pnm"; });

// A frame is listed only after its images are on disk.
// Its samples are in the axes of the body; the rig of the stream says how those of the readings are turned.
TEST(StreamRecorder, TheImuIsReadBackAsItCame) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/recording";
  StreamInfo info = tiny_stream();
  info.rig.imu.body_from_imu =
      Pose(Eigen::Quaterniond(Eigen::AngleAxisd(1.2, Eigen::Vector3d(1, 2, 3).normalized())), {0.1, 0.2, 0.3});
  auto recorder = StreamRecorder::create(path, info, ImageFiles::pnm).value();
  recorder->add(ImuSample{Stamp{1}, {0.1, 0.2, 0.3}, {1, 2, 9.8}});
  recorder->add(tiny_frame(0));
  ASSERT_TRUE(recorder->finish());
  const auto recording = open_recording(path).value();
  const auto imu = std::get<ImuSample>(*recording->next().value());
  EXPECT_EQ(imu.gyro_rad_s, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(imu.accel_m_s2, Eigen::Vector3d(1, 2, 9.8));
  EXPECT_EQ(recording->info().rig.imu.body_from_imu.translation(), info.rig.imu.body_from_imu.translation());
}

TEST(BatchedRecording, ListsFramesAtTheNextSync) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/recording";
  auto writer = RecordingWriter::create_batched(path, tiny_rig(), {}, ImageFiles::pnm).value();
  ASSERT_TRUE(writer.add(tiny_frame(0)));
  ASSERT_TRUE(writer.add(tiny_frame(1)));
  EXPECT_TRUE(std::filesystem::exists(path + "/images/stereo/100000000_left.pnm"));
  ASSERT_TRUE(writer.sync());
  EXPECT_EQ(listed_frames(path), 2U);
  ASSERT_TRUE(writer.add(tiny_frame(2)));
  EXPECT_EQ(listed_frames(path), 2U);
  const RecordedImages images = find_recorded_images(path, "stereo", tiny_frame(2).left_stamp);
  EXPECT_EQ(read_image(images.left)->size(), tiny_frame(2).left.size()) << "before it is listed";
  EXPECT_TRUE(read_image(images.right));
  EXPECT_TRUE(find_recorded_images(path, "stereo", Stamp{1}).left.empty());
  ASSERT_TRUE(writer.finish());
  EXPECT_EQ(listed_frames(path), 3U);
}

TEST(StreamRecorder, CountsWhatARecordingCannotHold) {
  const TemporaryFolder folder;
  const auto recorder = StreamRecorder::create(folder.path() + "/recording", tiny_stream(), ImageFiles::pnm).value();
  recorder->add(tiny_frame(1));
  recorder->add(tiny_frame(0));  // its stamp does not increase
  StereoFrame other = tiny_frame(2);
  other.pair = "no_such_pair";
  recorder->add(other);
  recorder->add(tiny_frame(3));
  ASSERT_TRUE(recorder->finish());
  EXPECT_EQ(recorder->progress().frames, 2);
  EXPECT_EQ(recorder->progress().rejected, 2);
}

// A process of its own: the limit of the file size stands for a full disk.
TEST(StreamRecorder, AFullDiskLeavesWhatWasWritten) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/recording";
  const pid_t child = ::fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    auto recorder = StreamRecorder::create(path, tiny_stream(), ImageFiles::pnm).value();
    for (int i = 0; i < 3; ++i) recorder->add(tiny_frame(i));
    std::this_thread::sleep_for(1500ms);  // synced
    const rlimit none{100, 100};
    ::setrlimit(RLIMIT_FSIZE, &none);
    for (int i = 3; i < 6; ++i) recorder->add(tiny_frame(i));
    const Status finished = recorder->finish();
    const bool said = !finished && finished.error().code == ErrorCode::output;
    ::_exit(said && recorder->progress().frames == 3 ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_EQ(listed_frames(path), 3U);
  EXPECT_FALSE(std::filesystem::exists(path + "/recording.yaml")) << "it is not finished";
  const auto recording = open_recording(path);
  ASSERT_TRUE(recording) << recording.error().message();
  EXPECT_EQ(testing::collect_samples(**recording).frames.size(), 3U);
  EXPECT_EQ((*recording)->info().gravity_m_s2, 3.71);
  const auto resumed = RecordingWriter::resume(path, tiny_rig(), {});
  EXPECT_EQ(resumed.error().code, ErrorCode::output) << "a simulation does not overwrite it";
}

// As after a loss of power while tables were written.
TEST(StreamRecorder, WhatIsNotWholeInItsTablesIsLeftOut) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/recording", finished = path + "/recording.yaml";
  {
    const auto recorder = StreamRecorder::create(path, tiny_stream(), ImageFiles::pnm).value();
    for (int i = 0; i < 3; ++i) recorder->add(tiny_frame(i));
    recorder->add(ImuSample{Stamp{1}, {0, 0, 0}, {0, 0, 9.8}});
    ASSERT_TRUE(recorder->finish());
  }
  const std::string frames = read_file(path + "/frames.csv").value();
  EXPECT_FALSE(std::filesystem::exists(path + "/unfinished_recording.yaml"));
  const std::string cut = frames.substr(0, frames.size() - 20), zeros = cut + std::string(4096, '\0') + "00\n";
  for (const std::string& damaged : {cut, zeros}) {
    static_cast<void>(folder.write("recording/frames.csv", damaged));
    for (const std::string table : {"", "stamp_ns,gyro_x"}) {
      static_cast<void>(folder.write("recording/sensors/imu.csv", table));
      std::filesystem::rename(finished, path + "/unfinished_recording.yaml");
      const auto recording = open_recording(path);
      ASSERT_TRUE(recording) << recording.error().message();
      const auto samples = testing::collect_samples(**recording);
      EXPECT_EQ(samples.error, "");
      EXPECT_EQ(samples.all.size(), 2U);
      EXPECT_FALSE((*recording)->info().sequence.warnings.empty());
      std::filesystem::rename(path + "/unfinished_recording.yaml", finished);
      EXPECT_FALSE(open_recording(path)) << "a finished recording is damaged";
    }
  }
}

// Killed at any time, every listed frame has both images.
TEST(StreamRecorder, KilledLeavesOnlyWholeFrames) {
  for (const int after_ms : {300, 1100, 1400}) {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/recording";
    const pid_t child = ::fork();
    if (child == 0) {
      const auto recorder = StreamRecorder::create(path, tiny_stream(), ImageFiles::pnm).value();
      for (int i = 0;; ++i) {
        recorder->add(tiny_frame(i));
        std::this_thread::sleep_for(2ms);
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(after_ms));
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_TRUE(after_ms < 1000 || listed_frames(path) > 100U);
    const auto recording = open_recording(path);
    if (!recording) continue;  // nothing was listed yet
    const auto samples = testing::collect_samples(**recording);
    EXPECT_TRUE(samples.missing.empty()) << samples.missing.front().message;
  }
}

}  // namespace
}  // namespace spartan
