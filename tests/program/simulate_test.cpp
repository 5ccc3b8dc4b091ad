// `spartan simulate` from outside: small drives, impossible scenarios, kills, full disks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "program.h"
#include "small_scenario.h"
#include "spartan/rig/rig.h"
#include "spartan/storage/geotiff.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::kSmallRig;
using testing::kSmallScenario;
using ::testing::Not;
using testing::ProgramLimits;
using testing::ProgramResult;
using testing::run_program;

// Path below the folder → content.
std::map<std::string, std::string> files_below(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream file(entry.path(), std::ios::binary);
    std::stringstream content;
    content << file.rdbuf();
    files[fs::relative(entry.path(), folder).string()] = content.str();
  }
  return files;
}

ProgramLimits killed_after(int ms) {
  ProgramLimits limits;
  limits.kill_after = std::chrono::milliseconds(ms);
  return limits;
}

class Simulate : public ::testing::Test {
 protected:
  void SetUp() override {
    write("small_rig.yaml", kSmallRig);
    write("small.yaml", kSmallScenario);
    if (run_program({"simulate", path("nothing"), "-o", path("x")}).err.find("no simulator") != std::string::npos)
      GTEST_SKIP() << "built without Embree";
  }
  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }
  void write(const std::string& name, const std::string& text) const { std::ofstream(path(name)) << text; }
  ProgramResult simulate(const std::string& output, std::vector<std::string> more = {},
                         const ProgramLimits& limits = {}) const {
    std::vector<std::string> words{"simulate", path("small.yaml"), "-o", path(output)};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words, limits);
  }
  // The scenario with one more line; it must be refused with code 4, name the line and render nothing.
  void expect_refused(const std::string& line, const std::string& complaint) const {
    write("bad.yaml", std::string(kSmallScenario) + line + "\n");
    const ProgramResult result = run_program({"simulate", path("bad.yaml"), "-o", path("bad")});
    EXPECT_EQ(result.exit_code, 4) << line << "\n" << result.err;
    EXPECT_THAT(result.err, HasSubstr("bad.yaml:9")) << line;
    EXPECT_THAT(result.err, HasSubstr(complaint)) << line;
    EXPECT_FALSE(fs::exists(path("bad"))) << line;
  }

  testing::TemporaryFolder folder_;
};

TEST_F(Simulate, LeavesARecordingThatRunReadsWithItsTruth) {
  const ProgramResult result = simulate("rec", {"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto summary = nlohmann::json::parse(result.out);
  EXPECT_EQ(summary["schema"], 1);
  EXPECT_EQ(summary["frames"], 4 + 3);
  EXPECT_GT(summary["rays"], 0);
  EXPECT_GT(summary["rays_per_second_per_core"], 0);
  for (const char* file : {"recording.yaml", "rig.yaml", "frames.csv", "sensors/imu.csv", "sensors/wheels.csv",
                           "sensors/compass.csv", "sensors/inclinometer.csv", "truth/rig.yaml", "truth/poses.tum",
                           "truth/rocks.csv", "truth/elevation.tif", "truth/obstacles.tif", "truth/scenario.yaml"}) {
    EXPECT_TRUE(fs::exists(path("rec/" + std::string(file)))) << file;
  }
  int disparities = 0;
  for (const auto& entry : fs::recursive_directory_iterator(path("rec/truth/disparity")))
    disparities += entry.is_regular_file() ? 1 : 0;
  EXPECT_EQ(disparities, 7);
  EXPECT_EQ(files_below(path("rec"))["rig.yaml"], files_below(path("rec"))["truth/rig.yaml"]);
  const ProgramResult run = run_program({"run", path("rec"), "-o", path("out"), "--truth", path("rec"), "--json"});
  ASSERT_EQ(run.exit_code == 0 || run.exit_code == 6, true) << run.err;
  EXPECT_EQ(nlohmann::json::parse(run.out)["frames"], 4);
}

TEST_F(Simulate, ElevationIsAGeoTiffWithTheGround) {
  ASSERT_EQ(simulate("rec").exit_code, 0);
  const auto map = read_geotiff(path("rec/truth/elevation.tif"));
  if (!map && map.error().code == ErrorCode::usage) GTEST_SKIP() << map.error().message();
  ASSERT_TRUE(map) << map.error().message();
  EXPECT_EQ(map->names, (std::vector<std::string>{"elevation_m", "ground_m"}));
  EXPECT_NEAR(map->bands[0].width(), 103, 2);
  EXPECT_NEAR(map->bands[0].height(), 100, 2);
  EXPECT_NEAR(map->place.west_m, -5, 0.11);
  EXPECT_NEAR(map->place.north_m, 5, 0.11);
  // The body begins on the ground at height 0.
  const int x = static_cast<int>(-map->place.west_m / map->place.cell_m),
            y = static_cast<int>(map->place.north_m / map->place.cell_m);
  EXPECT_NEAR(map->bands[1](x, y), 0, 0.05);
  double rocks = 0;
  for (int j = 0; j < map->bands[0].height(); ++j) {
    for (int i = 0; i < map->bands[0].width(); ++i) {
      ASSERT_GE(map->bands[0](i, j), map->bands[1](i, j) - 0.02F);
      rocks = std::max(rocks, static_cast<double>(map->bands[0](i, j) - map->bands[1](i, j)));
    }
  }
  EXPECT_GT(rocks, 0.03);
}

TEST_F(Simulate, TheSameSeedGivesTheSameBytesWhateverTheThreads) {
  ASSERT_EQ(simulate("one", {"--threads", "1"}).exit_code, 0);
  ASSERT_EQ(simulate("two", {"--threads", "2"}).exit_code, 0);
  const auto one = files_below(path("one")), two = files_below(path("two"));
  ASSERT_EQ(one.size(), two.size());
  for (const auto& [name, content] : one) EXPECT_TRUE(two.at(name) == content) << name;
  ASSERT_EQ(simulate("other", {"--seed", "2"}).exit_code, 0);
  EXPECT_NE(files_below(path("other"))["truth/poses.tum"], one.at("truth/poses.tum"));
}

// Exposure times of the narrow pair, in the order of the frames.
std::vector<std::string> narrow_exposures(const std::string& frames_csv) {
  std::istringstream lines(frames_csv);
  std::vector<std::string> exposures;
  std::ptrdiff_t column = -1;
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> words;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) words.push_back(cell);
    if (column < 0) {
      column = std::find(words.begin(), words.end(), "exposure_us") - words.begin();
    } else if (line.find("narrow") != std::string::npos) {
      exposures.push_back(words.at(static_cast<std::size_t>(column)));
    }
  }
  return exposures;
}

TEST_F(Simulate, AMeterThatLagsExposesAsForTheFrameBefore) {
  write("late.yaml", std::string(kSmallScenario) + "\nsensor: {meter_lags: true}\n");
  ASSERT_EQ(simulate("rec").exit_code, 0);
  ASSERT_EQ(run_program({"simulate", path("late.yaml"), "-o", path("late")}).exit_code, 0);
  const std::vector<std::string> exposures = narrow_exposures(files_below(path("rec"))["frames.csv"]),
                                 late = narrow_exposures(files_below(path("late"))["frames.csv"]);
  ASSERT_EQ(exposures.size(), 4U);
  ASSERT_EQ(late.size(), 4U);
  EXPECT_NE(exposures[1], exposures[2]);
  EXPECT_EQ(late[0], exposures[0]) << "there is no frame before";
  for (std::size_t i = 1; i < late.size(); ++i) EXPECT_EQ(late[i], exposures[i - 1]);
}

TEST_F(Simulate, AnotherNoiseSeedChangesTheImagesAlone) {
  write("noisy.yaml", std::string(kSmallScenario) + "\nsensor: {noise_seed: 3}\n");
  ASSERT_EQ(simulate("one").exit_code, 0);
  ASSERT_EQ(run_program({"simulate", path("noisy.yaml"), "-o", path("other")}).exit_code, 0);
  const auto one = files_below(path("one")), other = files_below(path("other"));
  ASSERT_EQ(one.size(), other.size());
  for (const auto& [name, content] : other) {
    const bool image = name.starts_with("images/");
    if (name == "truth/scenario.yaml") continue;
    EXPECT_EQ(one.at(name) != content, image) << name;
  }
}

TEST_F(Simulate, GoesOnAfterKillsAsIfNothingHadHappened) {
  ASSERT_EQ(simulate("whole").exit_code, 0);
  const auto whole = files_below(path("whole"));
  int cut_off = 0;
  for (int ms = 40; ms < 5000 && !fs::exists(path("killed/recording.yaml")); ms = ms * 3 / 2) {
    cut_off += simulate("killed", {"--resume"}, killed_after(ms)).signal == SIGKILL ? 1 : 0;
  }
  EXPECT_GT(cut_off, 1);
  const ProgramResult resumed =
      fs::exists(path("killed/recording.yaml")) ? ProgramResult{0, 0, "", ""} : simulate("killed", {"--resume"});
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  const auto killed = files_below(path("killed"));
  ASSERT_EQ(killed.size(), whole.size());
  for (const auto& [name, content] : whole) EXPECT_TRUE(killed.contains(name) && killed.at(name) == content) << name;
}

TEST_F(Simulate, StopsCleanlyWhenInterrupted) {
  // Long enough not to be over before.
  write("small.yaml", std::string(kSmallScenario).replace(std::string(kSmallScenario).find("0.3}"), 4, "4}"));
  ProgramLimits interrupted;
  interrupted.interrupt_once_there = path("rec/frames.csv");
  const ProgramResult stopped = simulate("rec", {}, interrupted);
  ASSERT_EQ(stopped.exit_code, 130) << stopped.err;
  EXPECT_THAT(stopped.err, HasSubstr("--resume"));
  EXPECT_EQ(simulate("rec", {"--resume"}).exit_code, 0);
}

TEST_F(Simulate, KeepsWhatWasDoneWhenTheDiskIsFull) {
  ProgramLimits full_disk;
  full_disk.largest_file_bytes = 9000;
  const ProgramResult full = simulate("rec", {}, full_disk);
  ASSERT_EQ(full.exit_code, 5) << full.err;
  EXPECT_THAT(full.err, HasSubstr("rec/"));
  const auto before = files_below(path("rec"));
  EXPECT_FALSE(before.contains("recording.yaml"));
  ASSERT_EQ(simulate("rec", {"--resume"}).exit_code, 0);
  ASSERT_EQ(simulate("whole").exit_code, 0);
  const auto whole = files_below(path("whole")), after = files_below(path("rec"));
  ASSERT_EQ(after.size(), whole.size());
  for (const auto& [name, content] : whole) EXPECT_TRUE(after.at(name) == content) << name;
}

TEST_F(Simulate, WarnsOfFormerKeys) {
  write("small.yaml", std::string(kSmallScenario) + "believed: {rows_px: 0}\n");
  const ProgramResult result = simulate("former");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("believed is now called nominal_rig"));
}

TEST_F(Simulate, RefusesImpossibleScenariosWithLineAndReason) {
  expect_refused("soil: {contrast: -0.1}", "soil.contrast");
  expect_refused("imu: {gyro_bias_rad_s: -1}", "imu.gyro_bias_rad_s");
  expect_refused("sensor_faults: [{sensor: sonar, from_s: 1, to_s: 2}]", "'sonar'");
  expect_refused("sensor_faults: [{sensor: imu, from_s: 2, to_s: 1}]",
                 "sensor_faults[0].to_s: must be greater than from_s");
  expect_refused("camera_faults: [{pair: rear, from_s: 1, to_s: 2}]", "has no pair named 'rear'");
  expect_refused("light: {sun_lux: 0, sky_lux: 0}", "light.sky_lux: is 0, and so is sun_lux");
  expect_refused("light: {sun_lux: -5}", "light.sun_lux");
  expect_refused("colour: red", "unknown key");
  write("small.yaml", "schema: 1\nrig: small_rig.yaml\nsamples: 0\n");
  ProgramResult result = simulate("bad");
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("small.yaml:3: samples"));
  write("small.yaml", "schema: 1\nrig: small_rig.yaml\nrocks: {smallest_m: 0.5, largest_m: 0.4}\n");
  result = simulate("bad");
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("small.yaml:3: rocks.largest_m: must be greater than smallest_m"));
  write("small.yaml", "schema: 1\nrig: small_rig.yaml\nsamples: 3\npath:\n  length_m: 300\n");
  result = simulate("bad");
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("small.yaml:3: samples"));
  write("small.yaml", "schema: 1\nrig: small_rig.yaml\npath:\n  length_m: 300\n");
  result = simulate("bad");
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("small.yaml:3: path:"));
  EXPECT_THAT(result.err, HasSubstr("leaves the terrain"));
  write("small.yaml", "schema: 1\nrig: small_rig.yaml\ncapture:\n  stops_m: [99]\n");
  result = simulate("bad");
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("small.yaml:4: capture.stops_m"));
  write("small.yaml", "schema: 1\nrig: none.yaml\n");
  result = simulate("bad");
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("small.yaml:2: rig"));
  EXPECT_FALSE(fs::exists(path("bad")));
}

TEST_F(Simulate, RecognisesACalibrationGivenAsAScenario) {
  write("small.yaml", "cam0:\n  camera_model: pinhole\n  intrinsics: [1, 1, 1, 1]\n");
  const ProgramResult result = simulate("bad");
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("this is a calibration (kalibr), not a scenario"));
  write("small.yaml", "schema: 1\nrig: small_rig.yaml\ncolour: red\n");
  EXPECT_THAT(simulate("bad").err, Not(HasSubstr("calibration")));
}

TEST_F(Simulate, LeavesExistingFoldersAlone) {
  ASSERT_EQ(simulate("rec").exit_code, 0);
  const auto before = files_below(path("rec"));
  EXPECT_EQ(simulate("rec").exit_code, 5);
  EXPECT_EQ(simulate("rec", {"--resume"}).exit_code, 5) << "it is whole";
  EXPECT_EQ(files_below(path("rec")), before);
  fs::remove(path("rec/recording.yaml"));
  const ProgramResult other = simulate("rec", {"--resume", "--seed", "9"});
  EXPECT_EQ(other.exit_code, 4);
  EXPECT_THAT(other.err, HasSubstr("another scenario or seed"));
  fs::create_directories(path("mine"));
  write("mine/letter.txt", "dear");
  EXPECT_EQ(simulate("mine").exit_code, 5);
  EXPECT_EQ(simulate("mine", {"--resume"}).exit_code, 5);
}

TEST_F(Simulate, RecordsTheNominalRig) {
  write("small.yaml",
        std::string(kSmallScenario) + "nominal_rig: {yaw_deg: 0.02, row_offset_px: 0.3, focal_percent: 0.1}\n");
  ASSERT_EQ(simulate("rec").exit_code, 0);
  auto files = files_below(path("rec"));
  EXPECT_NE(files["rig.yaml"], files["truth/rig.yaml"]);
  EXPECT_THAT(files["rig.yaml"], HasSubstr("130.13"));
}

TEST_F(Simulate, AnotherRoverIsDrawnOnTheSameDrive) {
  ASSERT_EQ(simulate("exact").exit_code, 0);
  ASSERT_EQ(simulate("one", {"--set", "rover=ordinary"}).exit_code, 0);
  ASSERT_EQ(simulate("two", {"--set", "rover=ordinary", "--set", "rover_errors.seed=1"}).exit_code, 0);
  auto exact = files_below(path("exact")), one = files_below(path("one")), two = files_below(path("two"));
  for (const char* same : {"truth/poses.tum", "truth/rocks.csv", "sensors/imu.csv"}) {
    EXPECT_EQ(exact[same], one[same]) << same;
    EXPECT_EQ(one[same], two[same]) << same;
  }
  // The nominal rigs differ only in what they state about their errors.
  EXPECT_EQ(one["rig.yaml"], two["rig.yaml"]);
  Rig stated = read_rig_yaml(path("one/rig.yaml")).value();
  ASSERT_TRUE(stated.calibration_errors);
  EXPECT_EQ(stated.calibration_errors->mount_rotation_deg, 0.15);
  stated.calibration_errors = CalibrationErrors{0, 0, 0, 0, 0};
  EXPECT_EQ(to_rig_yaml(stated), exact["rig.yaml"]);
  EXPECT_EQ(exact["truth/rig.yaml"], exact["rig.yaml"]);
  EXPECT_NE(one["truth/rig.yaml"], exact["truth/rig.yaml"]);
  EXPECT_NE(one["truth/rig.yaml"], two["truth/rig.yaml"]);
  EXPECT_THAT(one["truth/scenario.yaml"], HasSubstr("rover: \"ordinary\""));
  const auto resumed = simulate("one", {"--set", "rover=poor", "--resume"});
  EXPECT_EQ(resumed.exit_code, 4) << "resumed with another rover";
}

TEST_F(Simulate, SetsKeysOfTheScenario) {
  const ProgramResult unknown = simulate("bad", {"--set", "rover.colour=red"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_EQ(simulate("bad", {"--set", "samples=3"}).exit_code, 4);
  EXPECT_FALSE(fs::exists(path("bad")));
  ASSERT_EQ(simulate("rec", {"--set", "sensor.jpeg_quality=50", "--set", "truth.disparity=false"}).exit_code, 0);
  EXPECT_FALSE(fs::exists(path("rec/truth/disparity")));
  EXPECT_THAT(files_below(path("rec"))["truth/scenario.yaml"], HasSubstr("jpeg_quality: 50"));
}

TEST_F(Simulate, NamesTheShippedScenarios) {
  const ProgramResult result = run_program({"simulate", "nowhere", "-o", path("x")});
  EXPECT_EQ(result.exit_code, 3);
  for (const char* name : {"quick", "traverse_100m", "loop", "crater_rim", "flat_featureless", "rocky_20pct",
                           "night_edge", "diffuse_200lux", "miscalibrated", "slip"}) {
    EXPECT_THAT(result.err, HasSubstr(name));
  }
}

}  // namespace
}  // namespace spartan
