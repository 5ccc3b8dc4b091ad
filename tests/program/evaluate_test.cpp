// `spartan evaluate` from outside.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "program.h"
#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/trajectory.h"
#include "spartan/rig/rig.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using testing::ProgramResult;
using testing::run_program;
using testing::TemporaryFolder;

// Body poses of a bend of 30 m; `scale` stretches it.
Trajectory bend(double scale) {
  Trajectory trajectory;
  for (int i = 0; i <= 60; ++i) {
    const double turned = 0.01 * i;
    const Eigen::Vector3d position(50 * std::sin(turned), 50 * (1 - std::cos(turned)), 0);
    trajectory.push_back({Stamp{i * 100'000'000LL}, Pose(exp_so3({0, 0, turned}), scale * position)});
  }
  return trajectory;
}

Rig kitti_rig() {
  Camera left, right;
  left.name = "left";
  right.name = "right";
  left.size = right.size = {640, 480};
  left.model = right.model = PinholeModel{500, 500, 320, 240};
  return rig_of_one_pair("rig", left, right, Pose::from_translation({-0.5, 0, 0}));
}

std::string times_of(const Trajectory& trajectory) {
  std::string text;
  for (const auto& entry : trajectory) text += to_decimal_seconds(entry.stamp) + "\n";
  return text;
}

// A run of a KITTI recording whose SLAM trajectory is 1 % too long, and the recording's truth beside.
class Evaluate : public ::testing::Test {
 protected:
  Evaluate() {
    folder_.write("run/trajectory_odometry.tum", to_tum(bend(1.1)));
    folder_.write("run/trajectory_slam.tum", to_tum(bend(1.01)));
    folder_.write("run/rig.yaml", to_rig_yaml(kitti_rig()));
    folder_.write("kitti/poses.txt", to_kitti(in_recording_convention(kitti_rig(), bend(1))));
    folder_.write("kitti/times.txt", times_of(bend(1)));
    folder_.write("truth.tum", to_tum(bend(1)));
  }
  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }
  json evaluate(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "evaluate");
    arguments.emplace_back("--json");
    const ProgramResult result = run_program(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out, nullptr, false);
  }
  TemporaryFolder folder_;
};

TEST_F(Evaluate, TakesTheBestTrajectoryOfARunIntoTheConventionOfTheTruth) {
  const json j = evaluate({path("run"), "--truth", path("kitti"), "--align", "none", "--segments", "5,10,100"});
  EXPECT_EQ(j["schema"], 1);
  EXPECT_EQ(j["align"], "none");
  EXPECT_EQ(j["trajectory"], "slam");
  EXPECT_EQ(j["frames"], 61);
  EXPECT_NEAR(j["path_length_m"].get<double>(), 30, 0.01);
  const double chord = 100 * std::sin(0.3);
  EXPECT_NEAR(j["ate_m"]["max"].get<double>(), 0.01 * chord, 1e-6);
  EXPECT_NEAR(j["drift_percent"].get<double>(), chord / j["path_length_m"].get<double>(), 1e-5);
  ASSERT_EQ(j["segments"].size(), 3U);
  EXPECT_EQ(j["segments"][0]["length_m"], 5.0);
  // Ten chords of the bend are just short of 5 m, so a segment of 5 m has eleven.
  EXPECT_NEAR(j["segments"][0]["translation_percent"].get<double>(), 100 * std::sin(0.055) / 5, 1e-5);
  EXPECT_NEAR(j["segments"][0]["rotation_deg_per_m"].get<double>(), 0.0, 1e-6);
  EXPECT_EQ(j["segments"][2]["count"], 0);
  EXPECT_TRUE(j["segments"][2]["translation_percent"].is_null());
  EXPECT_EQ(j["rpe"]["delta_frames"], 1);
  EXPECT_NEAR(j["rpe"]["translation_m"]["rmse"].get<double>(), 0.005, 1e-5);
  EXPECT_NEAR(j["rpe"]["rotation_deg"]["max"].get<double>(), 0.0, 1e-6);
}

TEST_F(Evaluate, AnotherTrajectoryAndAlignmentOnDemand) {
  const json j =
      evaluate({path("run"), "--truth", path("kitti/poses.txt"), "--trajectory", "odometry", "--align", "sim3"});
  EXPECT_EQ(j["trajectory"], "odometry");
  EXPECT_NEAR(j["truth_from_estimate"]["scale"].get<double>(), 1 / 1.1, 1e-6);
  EXPECT_NEAR(j["ate_m"]["rmse"].get<double>(), 0, 1e-6);
}

TEST_F(Evaluate, FilesAreComparedAsTheyAre) {
  folder_.write("estimate.tum", to_tum(bend(1.01)));
  const json j = evaluate({path("estimate.tum"), "--truth", path("truth.tum"), "--align", "none", "--kitti"});
  EXPECT_EQ(j["trajectory"], "file");
  EXPECT_NEAR(j["ate_m"]["max"].get<double>(), std::sin(0.3), 1e-6);
  EXPECT_EQ(j["segments"].size(), 8U);
  EXPECT_EQ(j["segments"][7]["length_m"], 800.0);
  EXPECT_TRUE(j["nees"].is_null());
  EXPECT_THAT(j["reasons"]["nees"].get<std::string>(), HasSubstr("odometry of a run"));
}

TEST_F(Evaluate, RecordingsOfSpartanEurocAndTumVi) {
  folder_.write("own/truth/poses.tum", to_tum(bend(1)));
  folder_.write("euroc/mav0/state_groundtruth_estimate0/data.csv", to_euroc(bend(1)));
  folder_.write("tum_vi/mav0/mocap0/data.csv", to_euroc(bend(1)));
  for (const char* recording : {"own", "euroc", "tum_vi", "tum_vi/mav0"}) {
    const json j = evaluate({path("truth.tum"), "--truth", path(recording)});
    EXPECT_EQ(j["frames"], 61) << recording;
    EXPECT_NEAR(j["ate_m"]["max"].get<double>(), 0, 1e-6) << recording;
  }
}

TEST_F(Evaluate, KittiFilesWithoutTimesGoLineByLine) {
  folder_.write("alone/estimate.txt", to_kitti(in_recording_convention(kitti_rig(), bend(1.01))));
  const json j = evaluate({path("alone/estimate.txt"), "--truth", path("kitti")});
  EXPECT_EQ(j["frames"], 61);
  folder_.write("short/estimate.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  EXPECT_EQ(run_program({"evaluate", path("short/estimate.txt"), "--truth", path("kitti")}).exit_code, 3);
}

TEST_F(Evaluate, TruthWithoutRotationGivesNullAndTheReason) {
  Trajectory positions = bend(1);
  for (auto& entry : positions) entry.pose = Pose::from_translation(entry.pose.translation());
  folder_.write("positions.tum", to_tum(positions));
  const ProgramResult result = run_program({"evaluate", path("truth.tum"), "--truth", path("positions.tum"), "--json"});
  ASSERT_EQ(result.exit_code, 0);
  const json j = json::parse(result.out);
  for (const auto& value : {j["drift_percent"], j["segments"], j["rpe"]["rotation_deg"]}) EXPECT_TRUE(value.is_null());
  for (const char* name : {"drift_percent", "segments", "rpe.rotation_deg"}) {
    EXPECT_THAT(j["reasons"][name].get<std::string>(), HasSubstr("no rotation"));
  }
  EXPECT_EQ(result.out.find("nan"), std::string::npos);
}

TEST_F(Evaluate, PrintsATableForPeople) {
  const ProgramResult result = run_program({"evaluate", path("run"), "--truth", path("kitti")});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr("trajectory_slam.tum (slam)"));
  EXPECT_THAT(result.out, HasSubstr("ATE, m"));
  EXPECT_EQ(result.err, "");
}

TEST_F(Evaluate, FaultsHaveTheirExitCodes) {
  const std::string run = path("run"), truth = path("kitti");
  const auto code = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "evaluate");
    const ProgramResult result = run_program(arguments);
    EXPECT_NE(result.err, "");
    EXPECT_EQ(result.out, "");
    return result.exit_code;
  };
  EXPECT_EQ(code({run}), 2);
  EXPECT_EQ(code({run, "--truth", truth, "--align", "se4"}), 2);
  EXPECT_EQ(code({run, "--truth", truth, "--segments", "5,-1"}), 2);
  EXPECT_EQ(code({run, "--truth", truth, "--segments", "5", "--kitti"}), 2);
  EXPECT_EQ(code({run, "--truth", truth, "--max-dt", "nan"}), 2);
  EXPECT_EQ(code({run, "--truth", truth, "-q", "-v"}), 2);
  EXPECT_EQ(code({path("truth.tum"), "--truth", truth, "--trajectory", "slam"}), 2);
  EXPECT_EQ(code({path("none"), "--truth", truth}), 3);
  EXPECT_EQ(code({run, "--truth", path("none")}), 3);
  EXPECT_EQ(code({run, "--truth", run}), 3) << "a folder without truth";
  EXPECT_EQ(code({truth, "--truth", truth}), 3) << "a folder without an estimate";
  EXPECT_EQ(code({run, "--truth", truth, "--trajectory", "localization"}), 3) << "the run has none";
  folder_.write("later.tum", "1000 0 0 0 0 0 0 1\n");
  EXPECT_EQ(code({run, "--truth", path("later.tum")}), 3) << "nothing at the same time";
  folder_.write("run/rig.yaml", "schema: 1\n");
  EXPECT_EQ(code({run, "--truth", truth}), 4);
}

TEST_F(Evaluate, AFullDeviceIsAFaultOfTheOutput) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  const char* const program = std::getenv("SPARTAN_PROGRAM");
  ASSERT_NE(program, nullptr);
  const std::string command =
      std::string(program) + " evaluate '" + path("run") + "' --truth '" + path("kitti") + "' >/dev/full 2>/dev/null";
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 5);
}

TEST(Program, HelpAndVersionAreNoFaults) {
  EXPECT_EQ(run_program({"--help"}).exit_code, 0);
  EXPECT_EQ(run_program({"--version"}).exit_code, 0);
  const ProgramResult help = run_program({"evaluate", "--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, HasSubstr("Example:"));
  EXPECT_EQ(run_program({}).exit_code, 2);
  EXPECT_EQ(run_program({"fly"}).exit_code, 2);
}

TEST_F(Evaluate, RejectsSegmentsThatAreNoLengths) {
  for (const std::string bad : {"a", "-1", "0", "inf"}) {
    const auto result =
        testing::run_program({"evaluate", path("run"), "--truth", path("kitti"), "--segments", "1," + bad});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, ::testing::HasSubstr("'" + bad + "' is not a positive number"));
  }
}

}  // namespace
}  // namespace spartan
