// `spartan run` on recordings whose images are missing, damaged, repeated or out of order.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "run_on_small_drive.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using testing::byte_stable_content;
using testing::cut;
using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::run_program;
using testing::summary_of;

class RunImages : public testing::RunOnSmallDrive {};

TEST_F(RunImages, SkipsTruncatedImages) {
  cut(image(0, 3), 0.6);
  cut(image(1, 3), 0.6);
  cut(image(1, 9), 0.95);
  const ProgramResult result = run("out");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr(image(0, 3)));
  EXPECT_THAT(result.err, HasSubstr(image(1, 9)));
  const auto summary = summary_of(path("out"));
  EXPECT_EQ(summary["skipped"]["unreadable"], 1);
  EXPECT_EQ(summary["frames"], 13);
  EXPECT_EQ(summary["predicted_frames"], nlohmann::json::parse("[3]"));
  EXPECT_EQ(summary["health"]["odometry"]["degraded"], 1) << "the left image of frame 9 is used alone";
}

TEST_F(RunImages, SkipsImagesOfAnotherSize) {
  ASSERT_EQ(run_program({"stereo", image(0, 0), image(1, 0), "-o", path("stereo")}).exit_code, 0);
  testing::write_gray_png(image(1, 5), 200, 100);
  testing::write_gray_png(image(0, 9), 200, 100);
  testing::write_gray_png(image(1, 9), 200, 100);
  const ProgramResult result = run("out");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto summary = summary_of(path("out"));
  EXPECT_EQ(summary["skipped"]["wrong_size"], 1);
  EXPECT_EQ(summary["health"]["odometry"]["degraded"], 1) << "the left image of frame 5 is used alone";
  EXPECT_EQ(run_program({"stereo", image(0, 5), image(1, 5), "-o", path("stereo2")}).exit_code, 3);
}

TEST_F(RunImages, SkipsFramesOfAFrozenCamera) {
  const auto repeat = [&](int side, int of, int at) {
    fs::copy_file(image(side, of), image(side, at), fs::copy_options::overwrite_existing);
  };
  for (const int side : {0, 1}) {
    for (int i = 5; i <= 7; ++i) repeat(side, 4, i);
  }
  repeat(1, 10, 11);
  const ProgramResult result = run("out");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("frame 5 skipped (frozen): frame 5: left and right image of pair"));
  EXPECT_THAT(result.err, HasSubstr("frame 11 skipped (frozen): frame 11: right image of pair"));
  const auto summary = summary_of(path("out"));
  EXPECT_EQ(summary["skipped"], nlohmann::json::parse(R"({"frozen": 4})"));
  EXPECT_EQ(summary["predicted_frames"], nlohmann::json::parse("[5, 6, 7, 11]"));
  EXPECT_EQ(summary["health"]["odometry"]["standing"], 0);
  const ProgramResult score = run_program({"evaluate", path("out"), "--truth", drive(), "--align", "first", "--json"});
  ASSERT_EQ(score.exit_code, 0) << score.err;
  EXPECT_LT(nlohmann::json::parse(score.out)["ate_m"]["rmse"], 0.01);
  // Interrupted between two equal images, the run remembers the first one.
  for (const char* frames : {"5", "7"}) {
    const std::string part = std::string("part") + frames;
    ASSERT_EQ(run(part, {"--max-frames", frames}).exit_code, 0);
    ASSERT_EQ(run(part, {"--resume"}).exit_code, 0);
    EXPECT_EQ(byte_stable_content(path(part)), byte_stable_content(path("out"))) << frames;
  }
}

TEST_F(RunImages, FailsWhereNoFrameIsUsable) {
  for (int i = 0; i < 14; ++i) cut(image(1, i), 0.5);
  const ProgramResult result = run("out");
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_THAT(result.err, HasSubstr("no usable frame; first error: "));
  EXPECT_THAT(result.err, HasSubstr("image_1/000000.png"));
  EXPECT_FALSE(fs::exists(path("out"))) << "an empty run folder would block the next attempt";
}

TEST_F(RunImages, BridgesMissingFramesIfTheViewsOverlap) {
  for (int i = 3; i < 6; ++i) remove_pair(i);
  const ProgramResult result = run("out");
  const auto summary = summary_of(path("out"));
  EXPECT_EQ(summary["skipped"]["left_missing"], 3);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(summary["health"]["odometry"]["lost"], 0);
}

TEST_F(RunImages, MeasuresInOneImageWhereTheOtherIsMissing) {
  for (const int side : {0, 1}) {
    for (int i = 3; i < 6; ++i) fs::rename(image(side, i), path(std::to_string(i)));
    const std::string out = "out" + std::to_string(side);
    const ProgramResult result = run(out, {"--truth", drive()});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const auto summary = summary_of(path(out));
    EXPECT_TRUE(summary["skipped"].empty());
    EXPECT_EQ(summary["frames"], 14);
    EXPECT_EQ(summary["health"]["odometry"]["degraded"], 3);
    EXPECT_EQ(summary["health"]["odometry"]["lost"], 0);
    EXPECT_LT(summary["truth"]["ate_m"]["rmse"], 0.005);
    for (int i = 3; i < 6; ++i) fs::rename(path(std::to_string(i)), image(side, i));
  }
}

TEST_F(RunImages, CamerasThatAreDeadForMostOfTheDriveAreALoss) {
  for (int i = 3; i < 13; ++i) remove_pair(i);
  const ProgramResult result = run("out");
  EXPECT_EQ(result.exit_code, 6) << result.err;
  const auto summary = summary_of(path("out"));
  EXPECT_EQ(summary["health"]["odometry"]["lost"], 0) << "the views before and after the gap overlap";
  ASSERT_EQ(summary["lost_spans"].size(), 1U);
  EXPECT_EQ(summary["lost_spans"][0]["from_ns"], 1'000'000'000);
  EXPECT_EQ(summary["lost_spans"][0]["to_ns"], 6'500'000'000);
  EXPECT_EQ(summary["lost_spans"][0]["reason"], "10 frames skipped in 5.5 s, the first: left_missing");
}

TEST_F(RunImages, ReportsALossIfTheViewsDoNotOverlap) {
  // After the gap the images are upside down, so no landmark matches.
  for (int i = 3; i < 8; ++i) remove_pair(i);
  for (int i = 8; i < 14; ++i) {
    testing::turn_upside_down(image(0, i), image(1, i));
  }
  const ProgramResult result = run("out");
  EXPECT_EQ(result.exit_code, 6) << result.err;
  EXPECT_THAT(result.out, HasSubstr("there the poses are predictions, and the exit code is 6"));
  const auto summary = summary_of(path("out"));
  EXPECT_EQ(summary["lost_spans"].size(), 1U);
  EXPECT_EQ(summary["health"]["odometry"]["lost"], 1) << "tracking continues from the next frame";
  EXPECT_THAT(summary["lost_spans"][0]["reason"].get<std::string>(), ::testing::Not(::testing::IsEmpty()));
}

TEST_F(RunImages, SkipsFramesWithReversedStamps) {
  std::ifstream in(drive() + "/times.txt");
  std::string times, line;
  for (int i = 0; std::getline(in, line); ++i) times += (i == 6 ? std::string("0.1") : line) + "\n";
  std::ofstream(drive() + "/times.txt") << times;
  const ProgramResult result = run("out");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(summary_of(path("out"))["skipped"]["stamp_reversed"], 1);
}

}  // namespace
}  // namespace spartan
