// `spartan run` over a rover that stops and looks around: maps, all sensors, kills in the middle of a stop.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "program.h"
#include "run_results.h"
#include "small_scenario.h"
#include "spartan/core/geotiff.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using testing::byte_stable_content;
using testing::ProgramLimits;
using testing::ProgramResult;
using testing::run_program;

class Positions : public ::testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(path("small_rig.yaml")) << testing::kSmallRig;
    std::string scenario = testing::kSmallScenario;
    scenario.replace(scenario.find("[0]"), 3, "[0, 0.2]");
    std::ofstream(path("small.yaml")) << scenario;
    const ProgramResult made = run_program({"simulate", path("small.yaml"), "-o", path("rec")});
    if (made.err.find("no simulator") != std::string::npos) GTEST_SKIP() << "built without Embree";
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }
  ProgramResult run(const std::string& output, std::vector<std::string> more = {},
                    const ProgramLimits& limits = {}) const {
    std::vector<std::string> words{"run", path("rec"), "-o", path(output)};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words, limits);
  }
  static bool finished(const ProgramResult& result) { return result.exit_code == 0 || result.exit_code == 6; }
  std::vector<std::string> maps_of(const std::string& output) const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(path(output) + "/maps")) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with("local_") && name.ends_with(".tif")) names.push_back(name);
    }
    std::sort(names.begin(), names.end());
    return names;
  }
  testing::TemporaryFolder folder_;
};

TEST_F(Positions, BecomeMapsAndAllSensorsAreHeard) {
  const ProgramResult result = run("out", {"--json"});
  ASSERT_TRUE(finished(result)) << result.err;
  const auto summary = nlohmann::json::parse(result.out);
  EXPECT_EQ(summary["world"]["gravity"], "measured");
  EXPECT_EQ(summary["world"]["heading"], "east");
  for (const char* sensor : {"imu", "wheels", "compass", "inclinometer"}) {
    EXPECT_GT(summary["health"]["localization"][sensor]["ok"], 0) << sensor;
  }
  EXPECT_TRUE(fs::exists(path("out/trajectory_localization.tum")));
  const auto maps = maps_of("out");
  ASSERT_EQ(maps.size(), 2u) << "two stops";
  const auto map = read_geotiff(path("out/maps/") + maps[1]);
  ASSERT_TRUE(map) << map.error().message();
  EXPECT_EQ(map->names.front(), "elevation_m");
  EXPECT_EQ(map->bands.front().width(), 160);
}

// The first stop's narrow shot is the last thing that was committed.
TEST_F(Positions, AreMappedThoughTheRunStoppedInTheMiddleOfThem) {
  ASSERT_TRUE(finished(run("whole")));
  ASSERT_TRUE(finished(run("part", {"--max-frames", "1"})));
  EXPECT_TRUE(maps_of("part").empty());
  ASSERT_TRUE(finished(run("part", {"--resume"})));
  EXPECT_EQ(byte_stable_content(path("part")), byte_stable_content(path("whole")));
}

TEST_F(Positions, AreMappedAfterKillsAsIfNothingHadHappened) {
  const auto start = std::chrono::steady_clock::now();
  ASSERT_TRUE(finished(run("whole")));
  const auto took = std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - start);
  const auto whole = byte_stable_content(path("whole"));
  for (const double share : {0.2, 0.4, 0.6, 0.8}) {
    const std::string out = "killed_" + std::to_string(share);
    ProgramLimits limits;
    limits.kill_after = std::chrono::milliseconds(static_cast<int>(share * static_cast<double>(took.count())));
    run(out, {}, limits);
    ASSERT_TRUE(finished(run(out, {"--resume"})));
    EXPECT_EQ(byte_stable_content(path(out)), whole) << "killed after " << share << " of the run";
  }
}

TEST_F(Positions, GiveTheSameBytesForAnyNumberOfThreads) {
  ASSERT_TRUE(finished(run("one", {"--threads", "1"})));
  ASSERT_TRUE(finished(run("two", {"--threads", "2"})));
  EXPECT_EQ(byte_stable_content(path("one")), byte_stable_content(path("two")));
}

TEST_F(Positions, MapsCanBeSwitchedOff) {
  ASSERT_TRUE(finished(run("out", {"--set", "maps=false"})));
  EXPECT_TRUE(maps_of("out").empty());
}

}  // namespace
}  // namespace spartan
