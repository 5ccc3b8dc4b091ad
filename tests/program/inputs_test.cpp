// The same frames in every layout that is read give the same trajectory.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "input_layouts.h"
#include "program.h"
#include "run_results.h"
#include "spartan/core/trajectory.h"
#include "spartan/testing/real_data.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::run_program;

using testing::Arguments;
using testing::Frames;
using testing::Layout;
using testing::layouts;
using testing::six_digits;
using testing::times_text;
using testing::write_text;
using testing::write_video;

Trajectory poses_of(const std::string& run) {
  auto loaded = load_trajectory(run + "/trajectory_odometry.tum");
  EXPECT_TRUE(loaded) << loaded.error().message();
  return loaded ? loaded->poses : Trajectory();
}

ProgramResult run_odometry(const std::string& input, const std::string& output, const Arguments& more) {
  Arguments words{"run", input, "-o", output, "--odometry-only"};
  words.insert(words.end(), more.begin(), more.end());
  ProgramResult result = run_program(words);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return result;
}

// The trajectory of the frames in their own layout.
Trajectory own_trajectory(const Frames& frames, const std::string& folder) {
  const std::string own = folder + "/own";
  frames.write_both(own + "/image_0", own + "/image_1", six_digits);
  fs::copy_file(frames.calibration(), own + "/calib.txt");
  write_text(own + "/times.txt", times_text(frames));
  run_odometry(own, folder + "/run_own", {});
  return poses_of(folder + "/run_own");
}

void expect_same_trajectory(const Layout& layout, const Frames& frames, const Trajectory& a) {
  SCOPED_TRACE(layout.name);
  const testing::TemporaryFolder folder;
  const std::string input = folder.path() + "/in", output = folder.path() + "/run";
  const Arguments more = layout.write(frames, input);
  const ProgramResult result = run_odometry(input + layout.input, output, more);
  EXPECT_THAT(result.err, HasSubstr(layout.said));
  const Trajectory b = poses_of(output);
  ASSERT_EQ(a.size(), static_cast<std::size_t>(frames.count()));
  ASSERT_EQ(b.size(), a.size());
  const bool assumed = layout.said.find("assumed") != std::string::npos;
  double length_m = 0;
  for (std::size_t i = 1; i < a.size(); ++i) {
    length_m += (a[i].pose.translation() - a[i - 1].pose.translation()).norm();
    const double step_s = assumed ? 0.1 : seconds_between(a[i - 1].stamp, a[i].stamp);
    EXPECT_NEAR(seconds_between(b[i - 1].stamp, b[i].stamp), step_s, 0.011);
    if (layout.exact) {
      EXPECT_EQ(a[i].pose.matrix(), b[i].pose.matrix()) << "frame " << i;
    }
  }
  EXPECT_LT((a.back().pose.translation() - b.back().pose.translation()).norm(), 0.02 * length_m);
}

class Inputs : public ::testing::TestWithParam<Layout> {};

TEST_P(Inputs, GiveTheTrajectoryOfTheSmallDrive) {
  const testing::TemporaryFolder folder;
  const Frames frames(testing::small_runs_folder() + "/drive", 6);
  expect_same_trajectory(GetParam(), frames, own_trajectory(frames, folder.path()));
}

INSTANTIATE_TEST_SUITE_P(Layouts, Inputs, ::testing::ValuesIn(layouts()),
                         [](const auto& instance) { return instance.param.name; });

TEST(InputsOfKitti, GiveTheSameTrajectoryInEveryLayout) {
  const std::string kitti = testing::data_folder() + "/kitti_06";
  if (!fs::exists(kitti)) GTEST_SKIP() << "no real recordings; SPARTAN_DATA says where they are";
  const testing::TemporaryFolder folder;
  const Frames frames(kitti, 20);
  const Trajectory own = own_trajectory(frames, folder.path());
  for (const Layout& layout : layouts()) expect_same_trajectory(layout, frames, own);
}

// Also seeks, hashes the images and draws the report.
TEST(VideoInput, ResumesWithTheSameBytes) {
  const testing::TemporaryFolder folder;
  const Frames frames(testing::small_runs_folder() + "/drive", 8);
  write_video(frames, folder.path() + "/drive.avi", {0, 1});
  const auto run = [&](const std::string& output, const Arguments& more) {
    Arguments words{"run",   folder.path() + "/drive.avi", "-o", folder.path() + "/" + output,
                    "--rig", frames.calibration()};
    words.insert(words.end(), more.begin(), more.end());
    const ProgramResult result = run_program(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
  };
  run("whole", {});
  EXPECT_TRUE(fs::exists(folder.path() + "/whole/report/index.html"));
  run("part", {"--max-frames", "5"});
  run("part", {"--resume"});
  EXPECT_EQ(testing::byte_stable_content(folder.path() + "/whole"),
            testing::byte_stable_content(folder.path() + "/part"));
}

TEST(InputErrors, NameWhatIsThereAndWhatToDo) {
  const testing::TemporaryFolder folder;
  const auto error_of = [&](const std::string& input, Arguments more = {}) {
    Arguments words{"run", folder.path() + "/" + input, "-o", folder.path() + "/run"};
    words.insert(words.end(), more.begin(), more.end());
    const ProgramResult result = run_program(words);
    EXPECT_NE(result.exit_code, 0);
    return result.err;
  };
  folder.write("drive.bag", "#ROSBAG V2.0\n");
  EXPECT_THAT(error_of("drive.bag"), HasSubstr("ROS 1 bag"));
  fs::create_directories(folder.path() + "/bag2");
  folder.write("bag2/metadata.yaml", "rosbag2_bagfile_information:\n");
  EXPECT_THAT(error_of("bag2"), HasSubstr("spartan-bag import"));
  for (const char* name : {"one/left/a.png", "one/right/a.png"}) {
    fs::create_directories(fs::path(folder.path() + "/" + name).parent_path());
    cv::imwrite(folder.path() + "/" + name, cv::Mat(12, 16, CV_8U, cv::Scalar(90)));
  }
  EXPECT_THAT(error_of("one"), HasSubstr("--rig"));
  EXPECT_THAT(error_of("one", {"--left", "left"}), HasSubstr("--left and --right belong together"));
  EXPECT_THAT(error_of("one", {"--left", "l*.png", "--right", "right"}),
              HasSubstr("holds no image of the left camera"));
}

}  // namespace
}  // namespace spartan
