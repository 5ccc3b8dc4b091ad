#include "spartan/sim/scenario.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/files.h"
#include "spartan/testing/doc_example.h"

namespace spartan::sim {
namespace {

namespace fs = std::filesystem;

TEST(Scenario, ReadsTheExampleOfTheDocumentation) {
  const std::string text = testing::doc_example("scenario.yaml");
  ASSERT_FALSE(text.empty());
  const auto scenario = parse_scenario(text, "example");
  ASSERT_TRUE(scenario) << scenario.error().message();
  EXPECT_EQ(scenario->name, "my_mars");
  EXPECT_EQ(scenario->terrain.cavities_per_100m2, 4);
  ASSERT_EQ(scenario->camera_faults.size(), 2U);
  EXPECT_EQ(scenario->camera_faults[1].amount, 8);
  ASSERT_EQ(scenario->sensor_faults.size(), 1U);
  EXPECT_EQ(scenario->sensor_faults[0].kind, SensorFaultKind::freeze);
  EXPECT_FALSE(scenario->compass.enabled);
  const auto rig = read_rig_yaml(testing::source_folder() + "/config/rigs/rover_square.yaml");
  EXPECT_TRUE(plan_drive(*scenario, *rig, text, "example"));
}

TEST(Scenario, SurvivesWritingAndReading) {
  Scenario scenario;
  scenario.name = "a \"name\": with # signs";
  scenario.seed = 12;
  scenario.path.waypoints_m = {1, 0.5, 2, -1};
  scenario.sensor_faults = {{MotionSensor::compass, SensorFaultKind::freeze, 1, 2.5}};
  scenario.camera_faults = {{CameraFaultKind::left_dust, "narrow", 3, 4, 0},
                            {CameraFaultKind::stamp_jitter, "", 0, 9, 0.001}};
  const auto again = parse_scenario(dump_options(scenario), "again");
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_EQ(dump_options(*again), dump_options(scenario));
  EXPECT_EQ(again->camera_faults[1].amount, 0.001);
  EXPECT_EQ(again->sensor_faults[0].sensor, MotionSensor::compass);
}

// Keys of earlier versions are accepted with a warning and have the same effect.
TEST(Scenario, AcceptsFormerKeys) {
  const std::string former =
      "believed: {yaw_deg: 0.1, rows_px: 2}\nrocks: {share: 0.2}\nsoil: {grain: 1.1}\n"
      "path: {kind: standing, standing_s: 7}\nshots: {stops_m: [0], seconds_a_pan: 3}\n"
      "compass: {outlier_share: 0.5}\n";
  const auto scenario = parse_scenario(former, "former");
  ASSERT_TRUE(scenario) << scenario.error().message();
  EXPECT_EQ(scenario->rocks.coverage, 0.2);
  EXPECT_EQ(scenario->soil.octave_gain, 1.1);
  EXPECT_EQ(scenario->path.kind, PathKind::stationary);
  EXPECT_EQ(scenario->path.stationary_s, 7);
  EXPECT_EQ(scenario->capture.stops_m, std::vector<double>{0});
  EXPECT_EQ(scenario->capture.pan_period_s, 3);
  EXPECT_EQ(scenario->compass.outlier_fraction, 0.5);
  const auto again = parse_scenario(dump_options(*scenario), "again");
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_EQ(dump_options(*again), dump_options(*scenario));
  EXPECT_NE(dump_options(*scenario), dump_options(Scenario()));
  EXPECT_EQ(read_scenario(former, "former")->warnings.size(), 8U);
}

TEST(Scenario, ValidatesValuesThatWereSetInCode) {
  Scenario scenario;
  EXPECT_TRUE(validate(scenario, "scenario"));
  scenario.samples = 3;
  scenario.rocks.largest_m = scenario.rocks.smallest_m;
  scenario.light.sun_lux = scenario.light.sky_lux = 0;
  scenario.camera_faults = {{CameraFaultKind::dropped, "", 3, 2}};
  const Status status = validate(scenario, "scenario");
  ASSERT_FALSE(status);
  for (const char* key : {"samples must be", "rocks.largest_m", "light.sky_lux", "camera_faults[0].to_s"})
    EXPECT_NE(status.error().message().find(key), std::string::npos) << key << "\n" << status.error().message();
}

TEST(Scenario, ShippedScenariosCanBePlanned) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator(testing::source_folder() + "/config/scenarios")) {
    const auto text = read_file(entry.path().string());
    ASSERT_TRUE(text);
    const auto scenario = parse_scenario(*text, entry.path().string());
    ASSERT_TRUE(scenario) << scenario.error().message();
    EXPECT_EQ(scenario->name, entry.path().stem().string());
    const auto rig = read_rig_yaml(testing::source_folder() + "/config/rigs/" + scenario->rig + ".yaml");
    ASSERT_TRUE(rig) << rig.error().message();
    const auto drive = plan_drive(*scenario, *rig, *text, entry.path().string());
    ASSERT_TRUE(drive) << drive.error().message();
    EXPECT_EQ(scenario->capture.frame_step_m, 0.1) << scenario->name;
    EXPECT_GE(scenario->extent_m, 200) << scenario->name;
    EXPECT_EQ(scenario->samples, scenario->name == "quick" ? 2 : 4) << scenario->name;
    ++count;
  }
  EXPECT_EQ(count, 14);
}

TEST(Scenario, ErrorsInListsNameTheirLine) {
  const auto scenario = parse_scenario(
      "schema: 1\ncamera_faults:\n  - {kind: dropped, from_s: 1, to_s: 2}\n  - {kind: eaten, from_s: 1, to_s: 2, "
      "colour: 3}\n  - 7\n",
      "s");
  ASSERT_FALSE(scenario);
  EXPECT_NE(scenario.error().what.find("s:4: camera_faults[1].kind"), std::string::npos) << scenario.error().what;
  EXPECT_NE(scenario.error().what.find("s:4: camera_faults[1].colour: unknown key"), std::string::npos)
      << scenario.error().what;
  EXPECT_NE(scenario.error().what.find("s:5: camera_faults[2]"), std::string::npos) << scenario.error().what;
  EXPECT_NE(parse_scenario("camera_faults: 3\n", "s").error().what.find("must be a list"), std::string::npos);
}

}  // namespace
}  // namespace spartan::sim
