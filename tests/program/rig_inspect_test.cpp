// `spartan rig inspect` from outside: rigs alone, and what is known of real ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "program.h"
#include "small_drive.h"
#include "spartan/core/files.h"
#include "spartan/testing/real_data.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using testing::run_program;

TEST(RigInspect, DescribesThePublishedRover) {
  const auto result = run_program({"rig", "inspect", testing::source_folder() + "/config/rigs/rover.yaml"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("the right one is 200.0 mm to the right; not rotated"));
  EXPECT_THAT(result.out, HasSubstr("pan-tilt unit mast"));
}

TEST(RigInspect, JsonHoldsTheFiguresOfEveryPair) {
  const auto result = run_program({"rig", "inspect", testing::source_folder() + "/config/rigs/rover.yaml", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json summary = json::parse(result.out);
  EXPECT_EQ(summary["schema"], 1);
  ASSERT_EQ(summary["pairs"].size(), 2u);
  EXPECT_NEAR(summary["pairs"]["wide"]["baseline_m"], 0.2, 1e-9);
  EXPECT_NEAR(summary["pairs"]["wide"]["focal_px"], 1200.92, 0.01);
  EXPECT_NEAR(summary["pairs"]["narrow"]["hfov_deg"], 66, 0.001);
  EXPECT_NEAR(summary["pairs"]["narrow"]["vfov_deg"], 49.5, 0.001);
}

// Without images: the calibration, and findings from its numbers.
TEST(RigInspect, DescribesACalibrationAndItsFindings) {
  const testing::TemporaryFolder folder;
  const std::string long_one =
      folder.write("calib.txt", "P0: 500 0 320 0 0 500 240 0 0 0 1 0\nP1: 500 0 320 -60000 0 500 240 0 0 0 1 0\n");
  testing::write_gray_png(folder.file("image_0/000000.png"), 640, 480);
  const auto result = run_program({"rig", "inspect", long_one});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("\nbody: the left camera"));
  const json pair = json::parse(run_program({"rig", "inspect", long_one, "--json"}).out)["pairs"].front();
  ASSERT_EQ(pair["findings"].size(), 1u);
  EXPECT_EQ(pair["findings"][0]["id"], "baseline_unit");
  EXPECT_EQ(pair["findings"][0]["value"], 120);
  EXPECT_FALSE(pair.contains("verdict"));
}

TEST(RigInspect, BadFilesAreNamed) {
  const testing::TemporaryFolder folder;
  EXPECT_EQ(run_program({"rig", "inspect", folder.path() + "/none.yaml"}).exit_code, 3);
  EXPECT_EQ(run_program({"rig", "inspect"}).exit_code, 2);
  EXPECT_EQ(run_program({"rig"}).exit_code, 2);
  const std::string nan =
      folder.write("calib.txt", "P0: nan 0 320 0 0 500 240 0 0 0 1 0\nP1: 500 0 320 -60 0 500 240 0 0 0 1 0\n");
  const auto refused = run_program({"rig", "inspect", nan});
  EXPECT_EQ(refused.exit_code, 4);
  EXPECT_THAT(refused.err, HasSubstr("calib.txt"));
  EXPECT_THAT(refused.err, HasSubstr("P0"));
}

// What is known of the real pairs: the models' yaw of K10 is 1° off its images and rows are off by a pixel; KITTI's
// and EuRoC's are sound.
TEST(RigInspect, ChecksRealPairs) {
  const std::string data = testing::data_folder();
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no real recordings; SPARTAN_DATA says where they are";
  const auto verdict = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"rig", "inspect"});
    words.emplace_back("--json");
    const auto result = run_program(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out)["pairs"].front();
  };
  for (const char* name : {"kitti_06", "kitti_0013"}) {
    const json pair = verdict({data + "/" + name, "--recording", data + "/" + name, "--frames", "4"});
    EXPECT_EQ(pair["verdict"], "good") << name << pair["findings"];
  }
  EXPECT_EQ(verdict({data + "/euroc_v101", "--recording", data + "/euroc_v101", "--frames", "4"})["verdict"], "good");

  const std::string left = data + "/k10_pair/left4.png", right = data + "/k10_pair/right4.png";
  const std::string rigs = testing::source_folder() + "/config/rigs/";
  const json given = verdict({rigs + "k10.yaml", left, right});
  EXPECT_EQ(given["verdict"], "bad");
  std::vector<std::string> found;
  for (const json& finding : given["findings"]) found.push_back(finding["id"]);
  EXPECT_THAT(found, ::testing::UnorderedElementsAre("yaw_offset", "row_offset"));
  EXPECT_NEAR(given["corrections"]["yaw_deg"], -1, 0.15);
  EXPECT_NEAR(given["row_error_px"]["after"]["median"], -0.9, 0.2);
  EXPECT_NEAR(given["row_error_px"]["before"]["mean"], 14.6, 1);
  const json corrected = verdict({rigs + "k10_corrected.yaml", left, right});
  EXPECT_EQ(corrected["verdict"], "good") << corrected["findings"];
  EXPECT_LT(corrected["row_error_px"]["after"]["mean"], 0.5);

  const std::string boards = data + "/opencv_chessboard/";
  EXPECT_EQ(verdict({rigs + "opencv_chessboard.yaml", boards + "left*.jpg", boards + "right*.jpg"})["verdict"], "good");
  // Curiosity's images alone: not rectified, rows up to 5 px apart (pairs.md).
  const std::string mars = data + "/mars/msl_navcam_sol1431/";
  const json navcam = verdict({"-", mars + "NLB*.jpeg", mars + "NRB*.jpeg"});
  EXPECT_EQ(navcam["verdict"], "bad");
  EXPECT_LT(navcam["row_error_px"]["corrected"]["mean"], 0.2);
}

// The corrected rig of K10 gives flat ground with its three mock rocks on it.
TEST(RigInspect, CorrectedK10SeesFlatGroundAndRocks) {
  const std::string data = testing::data_folder() + "/k10_pair";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no k10_pair; SPARTAN_DATA says where it is";
  const testing::TemporaryFolder folder;
  // Level is where the ground is: the rover leans forward by 6.8° to it.
  const auto build = [&](const std::string& rig, const std::string& outlier_percent = "20") {
    const auto result = run_program({"map", "build", data + "/left4.png", data + "/right4.png", "--rig",
                                     testing::source_folder() + "/config/rigs/" + rig + ".yaml", "-o",
                                     folder.path() + "/" + rig, "--extent-m", "9", "--gravity", "0.118,0,-0.993",
                                     "--json", "--force", "--set", "mapping.max_outlier_percent=" + outlier_percent});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out);
  };
  // With every disparity mapped: more of the ground is free, and less than half as much an obstacle.
  const json all_given = build("k10", "100"), all_corrected = build("k10_corrected", "100");
  EXPECT_GT(all_corrected["cells"]["free"], all_given["cells"]["free"]);
  EXPECT_LT(all_corrected["cells"]["obstacle"], 0.5 * all_given["cells"]["obstacle"].get<double>());
  // The outlier probability finds most of the false obstacles of the given calibration.
  const json given = build("k10"), corrected = build("k10_corrected");
  EXPECT_LT(given["cells"]["obstacle"], 0.5 * all_given["cells"]["obstacle"].get<double>());
  EXPECT_LT(corrected["cells"]["obstacle"], 0.6 * given["cells"]["obstacle"].get<double>());
  const auto free_share = [](const json& map) {
    const json& cells = map["cells"];
    const double free = cells["free"], obstacle = cells["obstacle"], cavity = cells["cavity"];
    return free / (free + obstacle + cavity);
  };
  EXPECT_GT(free_share(corrected), free_share(given));
  EXPECT_LT(corrected["cells"]["cavity"], 60);
  // Three rocks stand in a row before the rover; what is nearer is the rover itself.
  const auto table = read_file(folder.path() + "/k10_corrected/obstacles.csv");
  ASSERT_TRUE(table);
  int rocks = 0, others = 0;
  std::istringstream lines(*table);
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    double x = 0, y = 0, width = 0, length = 0, height = 0;
    int cells = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf,%lf,%d", &x, &y, &width, &length, &height, &cells), 6) << line;
    if (cells < 10 || x < 0.6) continue;
    const bool rock = std::abs(y) < 0.7 && std::abs(height - 0.37) < 0.05;
    (rock ? rocks : others) += 1;
  }
  EXPECT_LE(others, 1) << *table;
  EXPECT_EQ(rocks, 3) << *table;
}

TEST(RigInspect, ReadsWhatOthersWrite) {
  const std::string data = testing::data_folder();
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no real recordings; SPARTAN_DATA says where they are";
  const struct {
    const char* path;
    double baseline_m, focal_px;
  } known[] = {{"kitti_06/calib.txt", 0.5372, 707.0912},
               {"kitti_06", 0.5372, 707.0912},
               {"euroc_v101/mav0/cam0/sensor.yaml", 0.1101, 458.654}};
  for (const auto& rig : known) {
    const auto result = run_program({"rig", "inspect", data + "/" + rig.path, "--json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json pair = json::parse(result.out)["pairs"].front();
    EXPECT_NEAR(pair["baseline_m"], rig.baseline_m, 1e-4) << rig.path;
    EXPECT_NEAR(pair["focal_px"], rig.focal_px, 1e-3) << rig.path;
  }
}

}  // namespace
}  // namespace spartan
