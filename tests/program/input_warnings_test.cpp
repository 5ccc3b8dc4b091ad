// Input that is not what a command takes it for: the command says so, and what to do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "program.h"
#include "spartan/core/trajectory.h"
#include "spartan/image_io/image_io.h"
#include "spartan/rig/rig.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ProgramResult;
using testing::run_program;

class InputWarnings : public ::testing::Test {
 protected:
  InputWarnings() { fs::copy(testing::small_runs_folder() + "/drive", drive(), fs::copy_options::recursive); }
  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }
  std::string drive() const { return path("drive"); }
  std::string image(int side) const { return drive() + "/image_" + std::to_string(side) + "/000000.png"; }

  ProgramResult stereo(const std::string& left, const std::string& right, std::vector<std::string> more = {}) const {
    std::vector<std::string> words{"stereo", left, right, "-o", path("out"), "--force"};
    words.insert(words.end(), more.begin(), more.end());
    ProgramResult result = run_program(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result;
  }
  testing::TemporaryFolder folder_;
};

TEST_F(InputWarnings, StereoOfAGoodPairHasNone) {
  EXPECT_EQ(stereo(image(0), image(1), {"-q"}).err, "");
}

TEST_F(InputWarnings, StereoHasTwoMethods) {
  const auto density = [&](const std::string& method) {
    const ProgramResult result = stereo(image(0), image(1), {"--json", "--method", method});
    return nlohmann::json::parse(result.out)["density_percent"].get<double>();
  };
  const double by_sgm = density("sgm"), by_blocks = density("block");
  EXPECT_GT(by_sgm, 70);
  EXPECT_GT(by_blocks, 50);
  EXPECT_NE(by_sgm, by_blocks);
  const ProgramResult refused =
      run_program({"stereo", image(0), image(1), "-o", path("refused"), "--method", "census"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("--method"));
  EXPECT_FALSE(fs::exists(path("refused")));
}

TEST_F(InputWarnings, StereoCountsMeasuredPixelsNotFilledOnes) {
  const auto density = [&](const std::string& fill) {
    const ProgramResult result = stereo(image(0), image(1), {"--json", "--set", "reconstruction.fill=" + fill});
    return nlohmann::json::parse(result.out)["density_percent"].get<double>();
  };
  EXPECT_EQ(density("true"), density("false"));
  EXPECT_THAT(stereo(image(1), image(0), {"--set", "reconstruction.fill=true"}).err,
              HasSubstr("left and right are exchanged"));
}

TEST_F(InputWarnings, StereoNamesExchangedImages) {
  EXPECT_THAT(stereo(image(1), image(0)).err, HasSubstr("left and right are exchanged"));
}

TEST_F(InputWarnings, StereoGivesTheRowErrorOfImagesThatAreNotRectified) {
  const Image<std::uint8_t> right = read_gray8(image(1)).value();
  Image<std::uint8_t> shifted(right.size());
  for (int y = 0; y < right.height(); ++y) {
    for (int x = 0; x < right.width(); ++x) shifted(x, y) = right(x, std::max(0, y - 4));
  }
  ASSERT_TRUE(write_png(path("shifted.png"), shifted));
  const std::string said = stereo(image(0), path("shifted.png")).err;
  EXPECT_THAT(said, HasSubstr("the images are not rectified: rows differ by 4.0 px"));
  EXPECT_THAT(said, HasSubstr("--rig"));
}

TEST_F(InputWarnings, StereoSaysThatEightBitTruthHasNoScale) {
  const Image<std::uint8_t> truth(320, 240, 20);
  ASSERT_TRUE(write_png(path("truth.png"), truth));
  EXPECT_THAT(stereo(image(0), image(1), {"--truth", path("truth.png")}).err, HasSubstr("--truth-scale"));
  EXPECT_THAT(stereo(image(0), image(1), {"--truth", path("truth.png"), "--truth-scale", "1"}).err,
              Not(HasSubstr("--truth-scale")));
}

// disparity.png has 16 bits of 1/256 px.
TEST_F(InputWarnings, StereoCountsDisparitiesThatThePngSaturates) {
  constexpr int kWidth = 480, kShift = 300;
  Image<std::uint8_t> left(kWidth, 64), right(kWidth, 64);
  std::minstd_rand random(1);
  for (int y = 0; y < left.height(); ++y) {
    for (int x = 0; x < kWidth; ++x) {
      left(x, y) = static_cast<std::uint8_t>(random() >> 8U);
      right(x, y) = static_cast<std::uint8_t>(random() >> 8U);
    }
    std::copy_n(&left(kShift, y), kWidth - kShift, &right(0, y));
  }
  ASSERT_TRUE(write_png(path("l.png"), left) && write_png(path("r.png"), right));
  const std::string saturated = "of more than 256 px are saturated in disparity.png";
  EXPECT_THAT(stereo(path("l.png"), path("r.png"), {"--max-disparity", "319"}).err, HasSubstr(saturated));
  EXPECT_THAT(stereo(path("l.png"), path("r.png"), {"--max-disparity", "240"}).err, Not(HasSubstr(saturated)));
}

TEST_F(InputWarnings, RunNamesExchangedCameras) {
  fs::rename(drive() + "/image_0", drive() + "/x");
  fs::rename(drive() + "/image_1", drive() + "/image_0");
  fs::rename(drive() + "/x", drive() + "/image_1");
  const ProgramResult result = run_program({"run", drive(), "-o", path("run")});
  EXPECT_EQ(result.exit_code, 6) << result.err;
  EXPECT_THAT(result.err, HasSubstr("swapped_eyes"));
  EXPECT_THAT(result.err, HasSubstr("spartan rig inspect"));
}

TEST_F(InputWarnings, RunSaysWhyItMakesNoMap) {
  const ProgramResult stops = run_program({"run", drive(), "-o", path("stops"), "--set", "maps_from=stops"});
  EXPECT_EQ(stops.exit_code, 0) << stops.err;
  EXPECT_THAT(stops.err, HasSubstr("no map: no stop has a view of another pair"));
  const ProgramResult part = run_program({"run", drive(), "-o", path("part"), "--max-frames", "1"});
  EXPECT_THAT(part.err, HasSubstr("no map yet"));
  const ProgramResult whole = run_program({"run", drive(), "-o", path("whole")});
  EXPECT_THAT(whole.err, Not(HasSubstr("no map")));
  EXPECT_TRUE(fs::exists(path("whole/maps/global.tif")));
}

TEST_F(InputWarnings, InspectReturnsACodeForABadCalibration) {
  const std::string rig = drive() + "/calib.txt";
  const auto code = [&](const std::string& left, const std::string& right, bool check) {
    std::vector<std::string> words{"rig", "inspect", rig, left, right};
    if (check) words.emplace_back("--check");
    return run_program(words).exit_code;
  };
  EXPECT_EQ(code(image(0), image(1), true), 0);
  EXPECT_EQ(code(image(1), image(0), true), 7);
  EXPECT_EQ(code(image(1), image(0), false), 0);
  EXPECT_EQ(run_program({"rig", "inspect", rig, "--check"}).exit_code, 2) << "without images";
}

// The exported poses are those of the body, x forward; the truth is of the camera, z forward.
TEST_F(InputWarnings, EvaluateTellsOtherAxes) {
  const std::string run = testing::small_runs_folder() + "/drive_run";
  ASSERT_EQ(run_program({"export", run, "--format", "tum", "-o", path("body.tum")}).exit_code, 0);
  const ProgramResult other = run_program({"evaluate", path("body.tum"), "--truth", drive()});
  EXPECT_THAT(other.out, HasSubstr("differ by a constant rotation"));
  const ProgramResult same = run_program({"evaluate", run, "--truth", drive()});
  EXPECT_THAT(same.out, Not(HasSubstr("constant rotation")));
}

TEST_F(InputWarnings, MapBuildComparesTheGroundWithTheRig) {
  ASSERT_EQ(run_program({"rig", "convert", drive() + "/calib.txt", path("rig.yaml")}).exit_code, 0);
  Rig rig = read_rig_yaml(path("rig.yaml")).value();
  rig.convention = PoseConvention::body;
  for (const double height_m : {0.5, 0.7}) {
    const Pose body_from_left =
        Pose(exp_so3({0, 25 * M_PI / 180, 0}), {0, 0, height_m}) * optical_from_forward().inverse();
    rig.cameras[0].mount_from_camera = body_from_left;
    rig.cameras[1].mount_from_camera = body_from_left * Pose::from_translation({0.12, 0, 0});
    folder_.write("mounted.yaml", to_rig_yaml(rig));
    const ProgramResult built =
        run_program({"map", "build", image(0), image(1), "--rig", path("mounted.yaml"), "-o", path("map"), "--force"});
    ASSERT_EQ(built.exit_code, 0) << built.err;
    if (height_m == 0.5) {
      EXPECT_THAT(built.err, Not(HasSubstr("disagree")));
    } else {
      EXPECT_THAT(built.err, HasSubstr("the ground in the images and the rig disagree: height of the camera 0.5"));
    }
  }
}

TEST_F(InputWarnings, MapBuildTakesAFrameOfARecording) {
  const ProgramResult built =
      run_program({"map", "build", "--recording", drive(), "--frame", "3", "-o", path("map"), "--json"});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  EXPECT_THAT(built.out, HasSubstr("\"rig\": null")) << "a KITTI calibration states no height";
  EXPECT_EQ(run_program({"map", "build", "--recording", drive(), "--frame", "99", "-o", path("x")}).exit_code, 3);
  EXPECT_EQ(run_program({"map", "build", "--recording", drive(), "-o", path("x")}).exit_code, 2);
}

}  // namespace
}  // namespace spartan
