// Detection of the folder layout, and its errors.
#include "spartan/camera/recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "spartan/testing/tiny_recordings.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

std::string error_of(const std::string& path, const OpenOptions& options = {}, ErrorCode code = ErrorCode::input) {
  const auto source = open_recording(path, options);
  if (source) return "no fault";
  EXPECT_EQ(source.error().code, code) << source.error().message();
  return source.error().message();
}

RecordingInfo info_of(const std::string& path, const OpenOptions& options = {}) {
  const auto source = open_recording(path, options);
  EXPECT_TRUE(source) << source.error().message();
  return source ? (*source)->info() : RecordingInfo{};
}

class Layouts : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
};

TEST_F(Layouts, RecognisesKitti) {
  testing::write_tiny_kitti(folder_, 2);
  const RecordingInfo info = info_of(folder_.path());
  EXPECT_EQ(info.format, RecordingFormat::kitti);
  EXPECT_EQ(info.layout_reason, "calib.txt and image_0 found");
  EXPECT_EQ(info.rig_source, folder_.path() + "/calib.txt");
  EXPECT_EQ(info.name, fs::path(folder_.path()).filename());
  EXPECT_EQ(info.path, folder_.path());
}

TEST_F(Layouts, RecognisesKittiRaw) {
  testing::write_tiny_kitti_raw(folder_, 2);
  EXPECT_EQ(info_of(folder_.path()).format, RecordingFormat::kitti_raw);
  EXPECT_THAT(info_of(folder_.path()).layout_reason, HasSubstr("image_00 found"));
}

TEST_F(Layouts, RecognisesEurocAboveAndInsideMav0) {
  testing::write_tiny_euroc(folder_, {0, 50'000'000}, {0, 50'000'000});
  EXPECT_EQ(info_of(folder_.path()).format, RecordingFormat::euroc);
  EXPECT_EQ(info_of(folder_.path()).layout_reason, "mav0/cam0/data.csv found");
  EXPECT_EQ(info_of(folder_.path() + "/mav0").layout_reason, "cam0/data.csv found");
}

TEST_F(Layouts, RecognisesSpartan) {
  testing::write_tiny_spartan(folder_, 2);
  const RecordingInfo info = info_of(folder_.path());
  EXPECT_EQ(info.format, RecordingFormat::spartan);
  EXPECT_EQ(info.layout_reason, "recording.yaml found");
  EXPECT_EQ(info.name, "tiny");
}

TEST_F(Layouts, KittiHasPrecedenceAndTheOthersAreReported) {
  testing::write_tiny_kitti(folder_, 2);
  testing::write_tiny_euroc(folder_, {0, 50'000'000}, {0, 50'000'000});
  testing::write_tiny_kitti_raw(folder_, 2);
  const RecordingInfo info = info_of(folder_.path());
  EXPECT_EQ(info.format, RecordingFormat::kitti);
  EXPECT_THAT(info.layout_reason, HasSubstr("--format kitti-raw is also possible: image_00 found"));
  EXPECT_THAT(info.layout_reason, HasSubstr("--format euroc is also possible: mav0/cam0/data.csv found"));
}

TEST_F(Layouts, UsesTheRequestedFormat) {
  testing::write_tiny_kitti(folder_, 2);
  testing::write_tiny_euroc(folder_, {0, 50'000'000}, {0, 50'000'000});
  const RecordingInfo info = info_of(folder_.path(), {.format = RecordingFormat::euroc, .rig_file = {}});
  EXPECT_EQ(info.format, RecordingFormat::euroc);
  EXPECT_EQ(info.layout_reason, "euroc requested");
  fs::remove_all(folder_.path() + "/mav0");
  EXPECT_THAT(error_of(folder_.path(), {.format = RecordingFormat::euroc, .rig_file = {}}),
              HasSubstr("cam0/data.csv: cannot be read"));
  EXPECT_THAT(error_of(folder_.path(), {.format = RecordingFormat::kitti_raw, .rig_file = {}}),
              HasSubstr("image_00/timestamps.txt: cannot be read"));
  EXPECT_THAT(error_of(folder_.path(), {.format = RecordingFormat::spartan, .rig_file = {}}),
              HasSubstr("has no recording.yaml"));
}

TEST_F(Layouts, RejectsOtherFoldersAndListsTheKnownLayouts) {
  EXPECT_THAT(error_of(folder_.path()), HasSubstr("the folder is empty"));
  EXPECT_THAT(error_of(folder_.path() + "/none"), HasSubstr("no such folder"));
  folder_.write("some/photo.png", "");
  for (const std::string& fault : {error_of(folder_.path()), error_of(folder_.path() + "/none")}) {
    for (const char* name :
         {"calib.txt", "image_0 ", "image_00", "timestamps.txt", "mav0/cam0/data.csv", "recording.yaml"}) {
      EXPECT_THAT(fault, HasSubstr(name));
    }
  }
  EXPECT_THAT(error_of(folder_.path() + "/some/photo.png"), HasSubstr("is a file"));
}

TEST_F(Layouts, UsesTheGivenCalibration) {
  testing::write_tiny_kitti(folder_, 2);
  fs::rename(folder_.path() + "/calib.txt", folder_.path() + "/mine.txt");
  EXPECT_THAT(error_of(folder_.path()), HasSubstr("not a recording of a known layout"));
  EXPECT_THAT(error_of(folder_.path(), {.format = RecordingFormat::kitti, .rig_file = {}}),
              HasSubstr("calib.txt: is missing: the recording has no calibration"));
  const TemporaryFolder other;
  testing::write_tiny_spartan(other, 1);
  const std::string rig = other.path() + "/rig.yaml";
  const RecordingInfo info = info_of(folder_.path(), {.format = {}, .rig_file = rig});
  EXPECT_EQ(info.rig_source, rig);
  EXPECT_EQ(info.rig, testing::tiny_rig());
  EXPECT_THAT(info.layout_reason, HasSubstr("a rig given"));
}

TEST(FormatNames, RoundTrip) {
  for (const RecordingFormat format :
       {RecordingFormat::spartan, RecordingFormat::kitti, RecordingFormat::kitti_raw, RecordingFormat::euroc}) {
    EXPECT_EQ(parse_recording_format(name_of(format)), format);
  }
  const auto wrong = parse_recording_format("rosbag");
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().code, ErrorCode::usage);
  EXPECT_THAT(wrong.error().message(), HasSubstr("choose one of kitti, spartan, kitti-raw, euroc"));
}

TEST(FaultNames, AreTheKeysOfTheSummary) {
  EXPECT_EQ(name_of(FrameFault::left_missing), "left_missing");
  EXPECT_EQ(name_of(FrameFault::right_missing), "right_missing");
  EXPECT_EQ(name_of(FrameFault::unreadable), "unreadable");
  EXPECT_EQ(name_of(FrameFault::wrong_size), "wrong_size");
  EXPECT_EQ(name_of(FrameFault::frozen), "frozen");
  EXPECT_EQ(name_of(FrameFault::stamp_reversed), "stamp_reversed");
  EXPECT_EQ(name_of(FrameFault::stamps_apart), "stamps_apart");
}

}  // namespace
}  // namespace spartan
