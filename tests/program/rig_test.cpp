// `spartan rig` from outside.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "program.h"
#include "spartan/testing/real_data.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using testing::run_program;

TEST(RigInspect, TellsThePublishedRover) {
  const auto told = run_program({"rig", "inspect", testing::source_folder() + "/config/rigs/rover.yaml"});
  EXPECT_EQ(told.exit_code, 0) << told.err;
  EXPECT_THAT(told.out, HasSubstr("the right one is 200.0 mm to the right; not turned"));
  EXPECT_THAT(told.out, HasSubstr("pan-tilt unit mast"));
}

TEST(RigInspect, JsonHoldsTheFiguresOfEveryPair) {
  const auto told = run_program({"rig", "inspect", testing::source_folder() + "/config/rigs/rover.yaml", "--json"});
  ASSERT_EQ(told.exit_code, 0) << told.err;
  const json summary = json::parse(told.out);
  EXPECT_EQ(summary["schema"], 1);
  ASSERT_EQ(summary["pairs"].size(), 2u);
  EXPECT_NEAR(summary["pairs"]["wide"]["baseline_m"], 0.2, 1e-9);
  EXPECT_NEAR(summary["pairs"]["wide"]["focal_px"], 1200.92, 0.01);
  EXPECT_NEAR(summary["pairs"]["narrow"]["hfov_deg"], 66, 0.001);
  EXPECT_NEAR(summary["pairs"]["narrow"]["vfov_deg"], 49.5, 0.001);
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
    const auto told = run_program({"rig", "inspect", data + "/" + rig.path, "--json"});
    ASSERT_EQ(told.exit_code, 0) << told.err;
    const json pair = json::parse(told.out)["pairs"].front();
    EXPECT_NEAR(pair["baseline_m"], rig.baseline_m, 1e-4) << rig.path;
    EXPECT_NEAR(pair["focal_px"], rig.focal_px, 1e-3) << rig.path;
  }
}

}  // namespace
}  // namespace spartan
