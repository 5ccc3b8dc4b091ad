#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "spartan/camera/frame_source.h"
#include "spartan/camera/recording_writer.h"
#include "spartan/testing/tiny_recordings.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::TemporaryFolder;
using testing::tiny_image;
using testing::tiny_rig;

Stamp stamp_of_shot(int i) {
  return Stamp{1'000'000'000LL * (i + 1)};
}

StereoFrame shot(int i) {
  StereoFrame frame;
  frame.frame_id = i;
  frame.pair = "stereo";
  frame.left_stamp = frame.right_stamp = stamp_of_shot(i);
  frame.left = FrameImage::own(tiny_image(static_cast<std::uint32_t>(2 * i)), {});
  frame.right = FrameImage::own(tiny_image(static_cast<std::uint32_t>(2 * i + 1)), {});
  return frame;
}

// Shots from `from` up to `to`, taken over where they are there; how many were.
int write_shots(RecordingWriter& writer, int from, int to) {
  int taken = 0;
  for (int i = from; i < to; ++i) {
    const auto there = writer.take_over("stereo", stamp_of_shot(i));
    EXPECT_TRUE(there) << there.error().message();
    if (*there) {
      ++taken;
    } else {
      EXPECT_TRUE(writer.add(shot(i)));
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

std::string image_path(const std::string& folder, int i, const char* eye) {
  return folder + "/images/stereo/" + std::to_string(stamp_of_shot(i).ns) + "_" + eye + ".png";
}

class ResumedRecording : public ::testing::Test {
 protected:
  // Cut off after `count` shots, as by a kill: nobody calls finish().
  void begin(int count) {
    auto writer = RecordingWriter::create(path_, tiny_rig(), {});
    ASSERT_TRUE(writer);
    EXPECT_EQ(write_shots(*writer, 0, count), 0) << "a fresh recording holds nothing to take over";
  }
  void expect_as_made_at_once(int count) {
    auto writer = RecordingWriter::create(at_once_, tiny_rig(), {});
    ASSERT_TRUE(writer);
    write_shots(*writer, 0, count);
    ASSERT_TRUE(writer->finish());
    EXPECT_EQ(content_of_folder(path_), content_of_folder(at_once_));
  }
  TemporaryFolder folder_;
  std::string path_ = folder_.path() + "/cut", at_once_ = folder_.path() + "/at_once";
};

TEST_F(ResumedRecording, IsAsIfMadeAtOnce) {
  begin(3);
  RecordingWriter writer = resumed(path_);
  EXPECT_EQ(write_shots(writer, 0, 5), 3);
  ASSERT_TRUE(writer.finish());
  expect_as_made_at_once(5);
}

TEST_F(ResumedRecording, MayBeCutOffAgainBeforeItComesToWhatWasThere) {
  begin(4);
  {
    RecordingWriter writer = resumed(path_);
    EXPECT_EQ(write_shots(writer, 0, 1), 1);
  }
  {
    RecordingWriter writer = resumed(path_);
    EXPECT_EQ(write_shots(writer, 0, 0), 0);
  }
  RecordingWriter writer = resumed(path_);
  EXPECT_EQ(write_shots(writer, 0, 6), 4);
  ASSERT_TRUE(writer.finish());
  expect_as_made_at_once(6);
}

TEST_F(ResumedRecording, AShotThatLacksAnImageOrHalfItsRowIsMadeAgain) {
  begin(4);
  fs::remove(image_path(path_, 1, "right"));
  fs::remove(image_path(path_, 2, "left"));
  const std::string table = testing::content_of(path_ + "/frames.csv");
  std::ofstream(path_ + "/frames.csv", std::ios::trunc) << table.substr(0, table.size() - 9);
  RecordingWriter writer = resumed(path_);
  EXPECT_EQ(write_shots(writer, 0, 4), 1);
  ASSERT_TRUE(writer.finish());
  expect_as_made_at_once(4);
}

TEST_F(ResumedRecording, MayHaveDiedBeforeItsFirstByte) {
  folder_.write("cut/frames.csv", "");
  RecordingWriter writer = resumed(path_);
  EXPECT_EQ(write_shots(writer, 0, 2), 0);
  ASSERT_TRUE(writer.finish());
  expect_as_made_at_once(2);
}

TEST_F(ResumedRecording, WhereThereIsNoneOneIsMade) {
  RecordingWriter writer = resumed(path_);
  EXPECT_EQ(write_shots(writer, 0, 2), 0);
  ASSERT_TRUE(writer.finish());
  expect_as_made_at_once(2);
}

TEST_F(ResumedRecording, AWholeOneIsLeftAsItIs) {
  RecordingWriter writer = resumed(path_);
  write_shots(writer, 0, 2);
  ASSERT_TRUE(writer.finish());
  const auto before = content_of_folder(path_);
  const auto again = RecordingWriter::resume(path_, tiny_rig(), {});
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::output);
  EXPECT_THAT(again.error().message(), HasSubstr("whole recording"));
  EXPECT_EQ(content_of_folder(path_), before);
}

TEST_F(ResumedRecording, AFolderOfSomethingElseIsLeftAsItIs) {
  folder_.write("cut/mine.txt", "mine");
  const auto writer = RecordingWriter::resume(path_, tiny_rig(), {});
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().code, ErrorCode::output);
  EXPECT_THAT(writer.error().message(), HasSubstr("no recording that was begun"));
  EXPECT_EQ(content_of_folder(path_).size(), 1U);
}

TEST_F(ResumedRecording, ShotsMustComeInOrderStill) {
  begin(3);
  RecordingWriter writer = resumed(path_);
  ASSERT_TRUE(*writer.take_over("stereo", stamp_of_shot(1)));
  const auto back = writer.take_over("stereo", stamp_of_shot(0));
  ASSERT_FALSE(back);
  EXPECT_THAT(back.error().message(), HasSubstr("does not come after"));
}

}  // namespace
}  // namespace spartan
