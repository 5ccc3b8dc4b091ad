// `spartan map` from outside.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "program.h"
#include "small_drive.h"
#include "spartan/core/files.h"
#include "spartan/slam/global_map.h"
#include "spartan/storage/geotiff.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using testing::run_program;

class MapBuild : public ::testing::Test {
 protected:
  void SetUp() override { testing::write_small_drive(drive_, {.frames = 1}); }
  testing::ProgramResult build(const std::string& output, std::vector<std::string> more) const {
    std::vector<std::string> words{"map",
                                   "build",
                                   drive_ + "/image_0/000000.png",
                                   drive_ + "/image_1/000000.png",
                                   "--rig",
                                   drive_ + "/calib.txt",
                                   "-o",
                                   folder_.path() + "/" + output};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words);
  }
  testing::TemporaryFolder folder_;
  const std::string drive_ = folder_.path() + "/drive";
};

// The camera is 0.5 m above level ground, pitched down by 25°.
TEST_F(MapBuild, FindsTheAttitudeAndMapsTheGround) {
  const auto result = build("map", {"--extent-m", "4", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json summary = json::parse(result.out);
  EXPECT_EQ(summary["attitude"]["source"], "along the ground");
  EXPECT_NEAR(summary["attitude"]["pitch_deg"], 25, 0.5);
  EXPECT_NEAR(summary["views"][0]["ground"]["height_m"], 0.5, 0.02);
  EXPECT_EQ(summary["columns"], 80);
  const auto map = read_geotiff(folder_.path() + "/map/map.tif");
  ASSERT_TRUE(map) << map.error().message();
  EXPECT_EQ(map->names.size(), 11u);
  double squares = 0;
  int known = 0, free = 0;
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 80; ++x) {
      const double z = map->bands[0](x, y);
      if (!std::isfinite(z)) continue;
      ++known;
      squares += (z + 0.5) * (z + 0.5);
      free += map->bands[8](x, y) == 1 ? 1 : 0;
    }
  }
  EXPECT_GT(known, 600);
  EXPECT_LT(std::sqrt(squares / known), 0.05) << "half a metre below the camera";
  EXPECT_GT(free, 0.9 * known);
  for (const char* file : {"map.png", "obstacles.csv", "range.pfm", "range_sigma.pfm", "panorama.png", "coverage.png",
                           "points.ply", "stereo_0_classes.png", "stereo_0_v_disparity.png"})
    EXPECT_TRUE(std::filesystem::exists(folder_.path() + "/map/" + file)) << file;
}

TEST_F(MapBuild, AcceptsTheSmallestExtent) {
  const auto result = build("small", {"--extent-m", "0.5", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(json::parse(result.out)["columns"], 10);
  const auto too_fine = build("fine", {"--extent-m", "1000", "--cell-m", "0.01"});
  EXPECT_EQ(too_fine.exit_code, 4);
  EXPECT_THAT(too_fine.err, HasSubstr("map.cell_m"));
}

TEST_F(MapBuild, TakesTheGivenGravity) {
  const auto result = build("map", {"--gravity", "0.5,0,-0.8660254", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json summary = json::parse(result.out);
  EXPECT_EQ(summary["attitude"]["source"], "given");
  EXPECT_NEAR(summary["attitude"]["pitch_deg"], 30, 1e-4) << "gravity points forward: the nose is down";
  EXPECT_NEAR(summary["attitude"]["roll_deg"], 0, 1e-4);
}

TEST_F(MapBuild, GivesTheSameBytesForAnyNumberOfThreads) {
  ASSERT_EQ(build("one", {"--threads", "1"}).exit_code, 0);
  ASSERT_EQ(build("two", {"--threads", "2"}).exit_code, 0);
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path() + "/one")) {
    const std::string name = entry.path().filename().string();
    EXPECT_EQ(read_file(entry.path().string()).value(), read_file(folder_.path() + "/two/" + name).value()) << name;
  }
}

TEST_F(MapBuild, WhatItCannotDoIsSaid) {
  const auto code = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"map", "build", "-o", folder_.path() + "/out"});
    return run_program(words).exit_code;
  };
  EXPECT_EQ(code({}), 2);
  EXPECT_EQ(code({drive_ + "/image_0/000000.png"}), 2);
  EXPECT_EQ(code({"--recording", drive_}), 2) << "no stop";
  EXPECT_EQ(code({"--recording", folder_.path() + "/none", "--position", "1"}), 3);
  const auto none =
      run_program({"map", "build", "-o", folder_.path() + "/out", "--recording", drive_, "--position", "9"});
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_THAT(none.err, HasSubstr("has no frame of the stop with position_id 9"));
  const auto gravity = build("out", {"--gravity", "0,0"});
  EXPECT_EQ(gravity.exit_code, 2);
  EXPECT_THAT(gravity.err, HasSubstr("--gravity: '0,0' is not three numbers"));
  EXPECT_EQ(build("out", {"--gravity", "0,0,0"}).exit_code, 2);
  EXPECT_EQ(build("out", {"--extent-m", "-1"}).exit_code, 2);
  EXPECT_EQ(build("out", {"--set", "mapping.map.no_such=1"}).exit_code, 2);
  folder_.write("file", "");
  EXPECT_EQ(build("file", {}).exit_code, 5) << "a file is in the way";
}

// Level ground of 1 x 1 m, seen from its middle.
LocalMap small_map(double x_m, double y_m, float elevation_m) {
  constexpr int kSide = 20;
  LocalMap local;
  local.place = {x_m - 0.5, y_m + 0.5, 0.05};
  for (Image<float>* layer : {&local.elevation_m, &local.elevation_min_m, &local.elevation_max_m})
    *layer = Image<float>(kSide, kSide, elevation_m);
  local.variance_m2 = Image<float>(kSide, kSide, 1e-4F);
  local.count = Image<float>(kSide, kSide, 5);
  local.kind = Image<GroundClass>(kSide, kSide, GroundClass::ground);
  local.occupancy_logodds = Image<float>(kSide, kSide, -1);
  return local;
}

TEST(MapInfo, DescribesAMapOfAnySize) {
  const testing::TemporaryFolder folder;
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  for (const double x : {0.0, 500.0}) {
    const Pose pose = Pose::from_translation({x, x, 0});
    ASSERT_TRUE(map.add(small_map(x, x, static_cast<float>(x) / 100), {}, {pose, Matrix6d::Zero()}, Matrix6d::Zero()));
  }
  ASSERT_TRUE(MapFile::save(map, folder.file("far.map")));
  const auto result = run_program({"map", "info", folder.file("far.map"), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json figures = json::parse(result.out);
  EXPECT_GT(figures["columns"], 10000);
  EXPECT_GT(figures["rows"], 10000);
  EXPECT_EQ(figures["cells"]["free"], 800);
  EXPECT_NEAR(figures["known_m2"], 2, 1e-9);
  EXPECT_EQ(figures["elevation_m"]["least"], 0);
  EXPECT_EQ(figures["elevation_m"]["most"], 5);
  EXPECT_NEAR(figures["sigma_m"]["median"], 0.01, 1e-6);
  EXPECT_EQ(run_program({"map", "info", folder.file("far.map")}).exit_code, 0);
}

}  // namespace
}  // namespace spartan
