// `spartan run` as a program: results, resuming, invalid input, full disk, kills.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "run_on_small_drive.h"
#include "spartan/core/trajectory.h"
#include "spartan/rig/rig.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using testing::byte_stable_content;
using ::testing::ContainsRegex;
using testing::cut;
using ::testing::HasSubstr;
using testing::ProgramLimits;
using testing::ProgramResult;
using testing::run_program;
using testing::summary_of;

class Run : public testing::RunOnSmallDrive {};

TEST_F(Run, WritesTrajectoryTerrainAndSummary) {
  const ProgramResult result = run("out", {"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto summary = summary_of(path("out"));
  EXPECT_EQ(nlohmann::json::parse(result.out), summary);
  EXPECT_EQ(summary["schema"], 1);
  EXPECT_EQ(summary["frames"], 14);
  EXPECT_EQ(summary["format"], "kitti");
  EXPECT_EQ(summary["world"]["gravity"], "ground");
  EXPECT_THAT(result.err, HasSubstr("world: z is the normal of the ground in the first images (body pitched 25."));
  const Trajectory driven = load_trajectory(path("out/trajectory_localization.tum")).value().poses;
  EXPECT_NEAR(driven.back().pose.translation().z(), 0, 0.01) << "level, though the camera looks down by 25°";
  EXPECT_NEAR(summary["distance_m"], 0.53, 0.03);
  EXPECT_EQ(summary["health"]["odometry"]["lost"], 0);
  EXPECT_TRUE(summary["stages"].contains("odometry"));
  EXPECT_EQ(summary["stages"]["imaging.contrast"]["count"], summary["stages"]["imaging"]["count"]);
  EXPECT_FALSE(summary["stages"].contains("imaging.rectify")) << "the images are rectified already";
  EXPECT_TRUE(fs::exists(path("out/run.sqlite")));
  EXPECT_FALSE(fs::exists(path("out/run.sqlite-wal"))) << "the store is closed";
  EXPECT_TRUE(fs::exists(path("out/terrain/0.ply")));
  EXPECT_TRUE(fs::exists(path("out/terrain/0.pfm")));
  EXPECT_TRUE(fs::exists(path("out/terrain/0.png")));

  const ProgramResult score = run_program({"evaluate", path("out"), "--truth", drive(), "--align", "first", "--json"});
  ASSERT_EQ(score.exit_code, 0) << score.err;
  EXPECT_LT(nlohmann::json::parse(score.out)["ate_m"]["rmse"], 0.01);
}

TEST_F(Run, OptionSelectsDenseDisparitiesForTheOdometry) {
  copy_finished_run("row");
  const ProgramResult dense = run("dense", {"--set", "odometry.reconstruction.source=dense", "--json"});
  ASSERT_EQ(dense.exit_code, 0) << dense.err;
  EXPECT_NE(testing::content_of(path("dense/trajectory_odometry.tum")),
            testing::content_of(path("row/trajectory_odometry.tum")));
  EXPECT_EQ(nlohmann::json::parse(dense.out)["stages"]["reconstruction"]["count"], 14) << "once a frame";
  const ProgramResult score =
      run_program({"evaluate", path("dense"), "--truth", drive(), "--align", "first", "--json"});
  ASSERT_EQ(score.exit_code, 0) << score.err;
  EXPECT_LT(nlohmann::json::parse(score.out)["ate_m"]["rmse"], 0.02);
}

TEST_F(Run, AlignsTheRowsOfThePairByItsFirstFrames) {
  Rig rig = read_rig_yaml(testing::small_runs_folder() + "/drive_run/rig.yaml").value();
  const StereoPair pair = rig.pairs.front();
  const Pose exact = rig.right_from_left(pair);
  const auto right = std::find_if(rig.cameras.begin(), rig.cameras.end(),
                                  [&](const Camera& camera) { return camera.name == pair.right; });
  right->mount_from_camera = right->mount_from_camera * Pose(exp_so3({0.004, 0, 0}), Eigen::Vector3d::Zero());
  std::ofstream(path("wrong.yaml")) << to_rig_yaml(rig);
  const std::vector<std::string> options{"--rig", path("wrong.yaml"), "--odometry-only"};
  const ProgramResult result = run("out", options);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, ContainsRegex("pair [a-z]+: rows differ by [0-9.]+ px on the mean"));
  const Rig aligned = read_rig_yaml(path("out/rig.yaml")).value();
  EXPECT_LT(rotation_angle(exact.inverse() * aligned.right_from_left(pair)), 0.0004);
  std::vector<std::string> as_given = options;
  as_given.insert(as_given.end(), {"--set", "align_rows=false"});
  const ProgramResult kept = run("kept", as_given);
  EXPECT_THAT(kept.err, ::testing::Not(HasSubstr("rows differ")));
  EXPECT_EQ(read_rig_yaml(path("kept/rig.yaml")).value(), rig);
}

TEST_F(Run, GivesTheSameBytesForAnyNumberOfThreads) {
  ASSERT_EQ(run("one", {"--threads", "1"}).exit_code, 0);
  copy_finished_run("two");
  EXPECT_EQ(byte_stable_content(path("one")), byte_stable_content(path("two")));
}

TEST_F(Run, ResumedRunGivesTheSameBytesAfterAKill) {
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(run("whole").exit_code, 0);
  const auto took = std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - start);
  const auto whole = byte_stable_content(path("whole"));
  for (const double share : {0.02, 0.3, 0.5, 0.7, 0.9}) {
    const std::string out = "killed_" + std::to_string(share);
    ProgramLimits limits;
    limits.kill_after = std::chrono::milliseconds(static_cast<int>(share * static_cast<double>(took.count())));
    const ProgramResult killed = run(out, {}, limits);
    EXPECT_TRUE(killed.signal == SIGKILL || killed.exit_code == 0);
    const ProgramResult resumed = run(out, {"--resume"});
    ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
    EXPECT_EQ(byte_stable_content(path(out)), whole) << "killed after " << share << " of the run";
  }
}

TEST_F(Run, ShowsItsProgressUpToTheLastFrameToProcess) {
  const ProgramResult part = run("part", {"--max-frames", "5"});
  ASSERT_EQ(part.exit_code, 0) << part.err;
  EXPECT_THAT(part.err, ContainsRegex("1/5 tracking, 0.0 m"));
  EXPECT_THAT(part.err, ContainsRegex("5/5 [a-z]+, [0-9.]+ m, [0-9.]+ frames/s"));
}

TEST_F(Run, ResumesWhereItWasInterrupted) {
  copy_finished_run("whole");
  ASSERT_EQ(run("part", {"--max-frames", "8"}).exit_code, 0);
  const auto first = summary_of(path("part"));
  const ProgramResult resumed = run("part", {"--resume"});
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(summary_of(path("part"))["resumed_from_frame"], 8);
  for (const char* time : {"wall_seconds", "cpu_seconds"})
    EXPECT_GT(summary_of(path("part"))[time], first[time]) << "of both executions";
  EXPECT_EQ(byte_stable_content(path("part")), byte_stable_content(path("whole")));
}

TEST_F(Run, CanBeResumedAfterAnInterruption) {
  ProgramLimits limits;
  limits.interrupt_once_there = path("out/run.sqlite");
  const ProgramResult stopped = run("out", {}, limits);
  ASSERT_EQ(stopped.exit_code, 130) << stopped.err;
  const ProgramResult resumed = run("out", {"--resume"});
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  copy_finished_run("whole");
  EXPECT_EQ(byte_stable_content(path("out")), byte_stable_content(path("whole")));
}

TEST_F(Run, RetainsCommittedFramesWhenTheDiskIsFull) {
  copy_finished_run("whole");
  ProgramLimits limits;
  limits.largest_file_bytes = 900'000;  // enough for the first checkpoint of the store and some frames, not for all
  const ProgramResult full = run("full", {}, limits);
  ASSERT_EQ(full.exit_code, 5) << full.err;
  EXPECT_THAT(full.err, HasSubstr(path("full")));
  const ProgramResult resumed = run("full", {"--resume"});
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_GT(summary_of(path("full"))["resumed_from_frame"], 0) << "something was committed before the disk was full";
  EXPECT_EQ(byte_stable_content(path("full")), byte_stable_content(path("whole")));
}

TEST_F(Run, DoesNotOverwriteAnExistingFolder) {
  copy_finished_run("out");
  const auto before = byte_stable_content(path("out"));
  const ProgramResult again = run("out");
  EXPECT_EQ(again.exit_code, 5);
  EXPECT_THAT(again.err, HasSubstr("--resume"));
  EXPECT_EQ(byte_stable_content(path("out")), before);
}

TEST_F(Run, RejectsResumingAnotherRun) {
  copy_finished_run("out");
  const ProgramResult other_options = run("out", {"--resume", "--set", "terrain.every_m=2"});
  EXPECT_EQ(other_options.exit_code, 4);
  EXPECT_THAT(other_options.err, HasSubstr("other options: terrain.every_m was 0.15, is 2"));
  std::ofstream(drive() + "/times.txt", std::ios::app) << "99.0\n";
  EXPECT_EQ(run("out", {"--resume"}).exit_code, 4) << "another input";
}

TEST_F(Run, RejectsFoldersThatAreNoRecording) {
  const ProgramResult missing = run_program({"run", path("nowhere"), "-o", path("out")});
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_THAT(missing.err, HasSubstr(path("nowhere")));
  fs::create_directory(path("empty"));
  const ProgramResult empty = run_program({"run", path("empty"), "-o", path("out")});
  EXPECT_EQ(empty.exit_code, 3);
  EXPECT_THAT(empty.err, HasSubstr("empty"));
  EXPECT_FALSE(fs::exists(path("out")));
}

TEST_F(Run, StereoUsesTheViewOptions) {
  const auto stereo = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"stereo", "--force",      image(0, 0), image(1, 0),
                                   "-o",     path("stereo"), "--rig",     drive() + "/calib.txt"};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words);
  };
  const ProgramResult valid =
      stereo({"--json", "--set", "imaging.view.width_px=200", "--set", "imaging.view.policy=all_valid"});
  ASSERT_EQ(valid.exit_code, 0) << valid.err;
  EXPECT_EQ(nlohmann::json::parse(valid.out)["width"], 200);
  const ProgramResult impossible =
      stereo({"--set", "imaging.view.focal_px=90000", "--set", "imaging.view.policy=whole_view"});
  EXPECT_EQ(impossible.exit_code, 4) << impossible.err;
  EXPECT_THAT(impossible.err, HasSubstr("not all that the cameras see fits"));
  EXPECT_EQ(stereo({"--set", "imaging.view.policy=any"}).exit_code, 2);
  EXPECT_EQ(stereo({"--set", "imaging.view.width_px=1", "--set", "imaging.view.policy=whole_view"}).exit_code, 4);
  const std::string all = "32767";
  EXPECT_EQ(stereo({"--set", "imaging.view.width_px=" + all, "--set", "imaging.view.height_px=" + all}).exit_code, 4);
  EXPECT_EQ(stereo({"--set", "imaging.view.focal_px=1e-9"}).exit_code, 4);
}

TEST_F(Run, WritesMessagesToTheLogFile) {
  fs::remove(image(1, 4));
  remove_pair(6);
  ASSERT_EQ(run("out", {"-q"}).exit_code, 0);
  std::ifstream file(path("out/log.txt"));
  const std::string log((std::istreambuf_iterator<char>(file)), {});
  EXPECT_THAT(log, HasSubstr("kitti recording (calib.txt and image_0 found)"));
  EXPECT_THAT(log, HasSubstr("image_1: has no image number 4; the other image is used alone"));
  EXPECT_THAT(log, HasSubstr("frame 6 skipped (left_missing)"));
}

TEST_F(Run, EvaluatesAgainstTheTruth) {
  const ProgramResult result = run("out", {"--truth", drive(), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto summary = summary_of(path("out"));
  EXPECT_EQ(nlohmann::json::parse(result.out), summary);
  EXPECT_EQ(summary["truth"]["align"], "se3");
  EXPECT_EQ(summary["truth"]["frames"], 14);
  EXPECT_LT(summary["truth"]["ate_m"]["rmse"], 0.005);
  // A truth file that cannot be read is reported before the first frame.
  const ProgramResult refused = run("other", {"--truth", path("none.txt")});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("none.txt"));
  EXPECT_FALSE(fs::exists(path("other")));
}

TEST_F(Run, RejectsAnInvalidCalibration) {
  std::ofstream(drive() + "/calib.txt")
      << "P0: nan 0 160 0 0 260 120 0 0 0 1 0\nP1: 260 0 160 -30 0 260 120 0 0 0 1 0\n";
  const ProgramResult result = run("out");
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("calib.txt:1"));
  EXPECT_FALSE(fs::exists(path("out")));
}

TEST_F(Run, RejectsUnknownOptions) {
  std::ofstream(path("options.yaml")) << "terrain:\n  every_m: 2\n  colour: red\nodometry:\n  speed: 3\n";
  const ProgramResult result = run("out", {"--config", path("options.yaml")});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("options.yaml:3: terrain.colour"));
  EXPECT_THAT(result.err, HasSubstr("options.yaml:5: odometry.speed"));
  EXPECT_EQ(run_program({"config", "check", path("options.yaml")}).exit_code, 4);
  EXPECT_EQ(run("out", {"--set", "terrain.every_m=-1"}).exit_code, 2);
  EXPECT_EQ(run("out", {"--no-such-flag"}).exit_code, 2);
  const ProgramResult dump = run_program({"config", "dump"});
  std::ofstream(path("all.yaml")) << dump.out;
  EXPECT_EQ(run_program({"config", "check", path("all.yaml")}).exit_code, 0);
}

TEST_F(Run, ReportsWhereItCannotWrite) {
  std::ofstream(path("file")) << "not a folder";
  const ProgramResult result = run("file/out");
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_THAT(result.err, HasSubstr(path("file/out")));
}

TEST_F(Run, ExportsForOtherTools) {
  cut(image(0, 3), 0.6);
  cut(image(1, 3), 0.6);
  ASSERT_EQ(run("out").exit_code, 0);
  for (const std::string format : {"tum", "kitti", "euroc", "csv", "ply"}) {
    const ProgramResult result = run_program({"export", path("out"), "--format", format, "-o", path("x." + format)});
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  EXPECT_FALSE(fs::exists(path("out/run.sqlite-wal"))) << "reading leaves no files";
  const auto lines = [&](const std::string& name) {
    const std::string text = testing::content_of(path(name));
    return std::count(text.begin(), text.end(), '\n');
  };
  EXPECT_EQ(lines("x.tum"), 13);
  EXPECT_EQ(lines("x.kitti"), 14) << "one line for every announced frame";
  fs::copy_file(drive() + "/times.txt", path("times.txt"));
  fs::rename(path("x.kitti"), path("poses.txt"));
  const ProgramResult score =
      run_program({"evaluate", path("poses.txt"), "--truth", drive() + "/poses.txt", "--align", "none", "--json"});
  ASSERT_EQ(score.exit_code, 0) << score.err;
  EXPECT_LT(nlohmann::json::parse(score.out)["ate_m"]["rmse"], 0.02) << "in KITTI's pose convention, without alignment";
  EXPECT_EQ(run_program({"export", path("out"), "--format", "xyz", "-o", path("x")}).exit_code, 2);
  EXPECT_EQ(run_program({"export", path("nowhere"), "--format", "tum", "-o", path("x")}).exit_code, 3);
}

}  // namespace
}  // namespace spartan
