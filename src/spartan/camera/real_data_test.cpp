// Real recordings below $SPARTAN_DATA, where available.
#include "spartan/testing/real_data.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "spartan/camera/recording.h"

namespace spartan {
namespace {

struct Counts {
  int frames = 0, missing = 0, imu = 0;
};

Counts count_samples(Recording& source) {
  Counts counts;
  for (;;) {
    auto sample = source.next();
    EXPECT_TRUE(sample) << sample.error().message();
    if (!sample || !*sample) return counts;
    counts.frames += std::holds_alternative<StereoFrame>(**sample);
    counts.missing += std::holds_alternative<MissingFrame>(**sample);
    counts.imu += std::holds_alternative<ImuSample>(**sample);
  }
}

struct Expected {
  const char* folder;
  RecordingFormat format;
  Counts counts;
  ImageSize size;
};

class RealData : public ::testing::TestWithParam<Expected> {};

TEST_P(RealData, MatchesItsReadme) {
  const Expected& expected = GetParam();
  const std::string path = testing::data_folder() + "/" + expected.folder;
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << expected.folder << " in $SPARTAN_DATA";
  auto source = open_recording(path);
  ASSERT_TRUE(source) << source.error().message();
  const RecordingInfo& info = (*source)->info();
  EXPECT_EQ(info.format, expected.format) << info.layout_reason;
  EXPECT_EQ(info.sequence.announced, expected.counts.frames);
  EXPECT_EQ(info.sequence.reversals + info.sequence.orphans_left + info.sequence.orphans_right, 0);
  EXPECT_TRUE(info.sequence.remarks.empty());
  EXPECT_FALSE(info.truth_file.empty());
  ASSERT_EQ(info.rig.cameras.size(), 2U);
  EXPECT_EQ(info.rig.cameras[0].size, expected.size);
  const Counts counts = count_samples(**source);
  EXPECT_EQ(counts.frames, expected.counts.frames);
  EXPECT_EQ(counts.missing, 0);
  EXPECT_EQ(counts.imu, expected.counts.imu);
}

INSTANTIATE_TEST_SUITE_P(Sequences, RealData,
                         ::testing::Values(Expected{"kitti_06", RecordingFormat::kitti, {51, 0, 0}, {1226, 370}},
                                           Expected{"kitti_0013", RecordingFormat::kitti, {48, 0, 0}, {1242, 375}},
                                           Expected{"rover_sandbox", RecordingFormat::kitti, {128, 0, 0}, {512, 285}}),
                         [](const auto& test) { return std::string(test.param.folder); });

}  // namespace
}  // namespace spartan
