#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "spartan/camera/recording.h"
#include "spartan/camera/recording_writer.h"
#include "spartan/testing/tiny_recordings.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::TemporaryFolder;
using testing::tiny_image;
using testing::tiny_rig;

Stamp stamp_of_frame(int i) {
  return Stamp{1'000'000'000LL * (i + 1)};
}

StereoFrame make_frame(int i) {
  StereoFrame frame;
  frame.frame_id = i;
  frame.pair = "stereo";
  frame.left_stamp = frame.right_stamp = stamp_of_frame(i);
  frame.left = FrameImage::own(tiny_image(static_cast<std::uint32_t>(2 * i)), {});
  frame.right = FrameImage::own(tiny_image(static_cast<std::uint32_t>(2 * i + 1)), {});
  return frame;
}

// Writes frames `from` … `to` − 1, reusing the existing ones; returns the number of reused frames.
int write_frames(RecordingWriter& writer, int from, int to) {
  int taken = 0;
  for (int i = from; i < to; ++i) {
    const auto there = writer.reuse_frame("stereo", stamp_of_frame(i));
    EXPECT_TRUE(there) << there.error().message();
    if (*there) {
      ++taken;
    } else {
      EXPECT_TRUE(writer.add(make_frame(i)));
    }
  }
  return taken;
}

RecordingWriter resumed(const std::string& folder) {
  auto writer = RecordingWriter::resume(folder, tiny_rig(), {});
  EXPECT_TRUE(writer) << writer.error().message();
  return std::move(*writer);
}

std::map<std::string, std::string> content_of_folder(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      files[fs::relative(entry.path(), folder).string()] = testing::content_of(entry.path().string());
  }
  return files;
}

std::string image_path(const std::string& folder, int i, const char* side) {
  return folder + "/images/stereo/" + std::to_string(stamp_of_frame(i).ns) + "_" + side + ".png";
}

class ResumedRecording : public ::testing::Test {
 protected:
  // Interrupted after `count` frames, as by a kill: finish() is not called.
  void begin(int count) {
    auto writer = RecordingWriter::create(path_, tiny_rig(), {});
    ASSERT_TRUE(writer);
    EXPECT_EQ(write_frames(*writer, 0, count), 0) << "a new recording has no frames to reuse";
  }
  void expect_as_made_at_once(int count) {
    auto writer = RecordingWriter::create(at_once_, tiny_rig(), {});
    ASSERT_TRUE(writer);
    write_frames(*writer, 0, count);
    ASSERT_TRUE(writer->finish());
    EXPECT_EQ(content_of_folder(path_), content_of_folder(at_once_));
  }
  TemporaryFolder folder_;
  std::string path_ = folder_.path() + "/cut", at_once_ = folder_.path() + "/at_once";
};

TEST_F(ResumedRecording, EqualsAnUninterruptedOne) {
  begin(3);
  RecordingWriter writer = resumed(path_);
  EXPECT_EQ(write_frames(writer, 0, 5), 3);
  ASSERT_TRUE(writer.finish());
  expect_as_made_at_once(5);
}

TEST_F(ResumedRecording, MayBeInterruptedAgainBeforeTheExistingFrames) {
  begin(4);
  {
    RecordingWriter writer = resumed(path_);
    EXPECT_EQ(write_frames(writer, 0, 1), 1);
  }
  {
    RecordingWriter writer = resumed(path_);
    EXPECT_EQ(write_frames(writer, 0, 0), 0);
  }
  RecordingWriter writer = resumed(path_);
  EXPECT_EQ(write_frames(writer, 0, 6), 4);
  ASSERT_TRUE(writer.finish());
  expect_as_made_at_once(6);
}

TEST_F(ResumedRecording, WritesIncompleteFramesAgain) {
  begin(4);
  fs::remove(image_path(path_, 1, "right"));
  fs::remove(image_path(path_, 2, "left"));
  const std::string table = testing::content_of(path_ + "/frames.csv");
  std::ofstream(path_ + "/frames.csv", std::ios::trunc) << table.substr(0, table.size() - 9);
  RecordingWriter writer = resumed(path_);
  EXPECT_EQ(write_frames(writer, 0, 4), 1);
  ASSERT_TRUE(writer.finish());
  expect_as_made_at_once(4);
}

TEST_F(ResumedRecording, MayHaveBeenInterruptedBeforeTheFirstRow) {
  folder_.write("cut/frames.csv", "");
  RecordingWriter writer = resumed(path_);
  EXPECT_EQ(write_frames(writer, 0, 2), 0);
  ASSERT_TRUE(writer.finish());
  expect_as_made_at_once(2);
}

TEST_F(ResumedRecording, IsCreatedWhereThereIsNone) {
  RecordingWriter writer = resumed(path_);
  EXPECT_EQ(write_frames(writer, 0, 2), 0);
  ASSERT_TRUE(writer.finish());
  expect_as_made_at_once(2);
}

TEST_F(ResumedRecording, AFinishedOneIsNotOverwritten) {
  RecordingWriter writer = resumed(path_);
  write_frames(writer, 0, 2);
  ASSERT_TRUE(writer.finish());
  const auto before = content_of_folder(path_);
  const auto again = RecordingWriter::resume(path_, tiny_rig(), {});
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::output);
  EXPECT_THAT(again.error().message(), HasSubstr("finished recording"));
  EXPECT_EQ(content_of_folder(path_), before);
}

TEST_F(ResumedRecording, AnotherFolderIsNotOverwritten) {
  folder_.write("cut/mine.txt", "mine");
  const auto writer = RecordingWriter::resume(path_, tiny_rig(), {});
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().code, ErrorCode::output);
  EXPECT_THAT(writer.error().message(), HasSubstr("not an unfinished recording"));
  EXPECT_EQ(content_of_folder(path_).size(), 1U);
}

TEST_F(ResumedRecording, FramesMustStillBeInOrder) {
  begin(3);
  RecordingWriter writer = resumed(path_);
  ASSERT_TRUE(*writer.reuse_frame("stereo", stamp_of_frame(1)));
  const auto back = writer.reuse_frame("stereo", stamp_of_frame(0));
  ASSERT_FALSE(back);
  EXPECT_THAT(back.error().message(), HasSubstr("does not come after"));
}

}  // namespace
}  // namespace spartan
