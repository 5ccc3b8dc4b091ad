// `spartan rig convert` from outside.
#include <fmt/format.h>
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
using testing::content_of;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::run_program;

const std::string kKitti = "P0: 500 0 320 0 0 500 240 0 0 0 1 0\nP1: 500 0 320 -60 0 500 240 0 0 0 1 0\n";

std::string rover() {
  return testing::source_folder() + "/config/rigs/rover.yaml";
}

std::vector<std::string> keys_of(const json& result) {
  std::vector<std::string> keys;
  for (const json& each : result["lost"]) keys.push_back(each["key"]);
  return keys;
}

TEST(RigConvert, NothingIsLostWhereNothingIs) {
  const testing::TemporaryFolder folder;
  const std::string kitti = folder.write("calib.txt", kKitti);
  const auto result = run_program({"rig", "convert", kitti, folder.path() + "/rig.yaml", "--size-px", "640,480"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("read kitti: " + kitti));
  EXPECT_THAT(result.out, HasSubstr("body: the left camera"));
  EXPECT_THAT(result.out, HasSubstr("wrote rig.yaml: " + folder.path() + "/rig.yaml\nnothing lost\n"));
  EXPECT_THAT(content_of(folder.path() + "/rig.yaml"), HasSubstr("size_px: [640, 480]"));
  // On through a format with one file per camera, and back.
  const auto there = run_program({"rig", "convert", folder.path() + "/rig.yaml", folder.path() + "/pair.cahvor"});
  EXPECT_EQ(there.exit_code, 0) << there.err;
  EXPECT_THAT(there.out,
              HasSubstr(fmt::format("wrote cahvor: {0}/pair_left.cahvor {0}/pair_right.cahvor\n", folder.path())));
  EXPECT_TRUE(std::filesystem::exists(folder.path() + "/pair_left.cahvor"));
  const auto back =
      run_program({"rig", "convert", folder.path() + "/pair_right.cahvor", folder.path() + "/again/calib.txt"});
  EXPECT_EQ(back.exit_code, 0) << back.err;
  EXPECT_EQ(content_of(folder.path() + "/again/calib.txt"), kKitti);
  EXPECT_THAT(back.out, HasSubstr("lost:\n  size_px: these files do not hold the image size, 640 x 480\n"));
}

TEST(RigConvert, WhatIsLostIsSaid) {
  const testing::TemporaryFolder folder;
  const std::string to = folder.path() + "/cameras";
  const auto result = run_program({"rig", "convert", rover(), to, "--to", "kalibr", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json all = json::parse(result.out);
  EXPECT_EQ(all["schema"], 1);
  EXPECT_EQ(all["format"], "kalibr");
  EXPECT_EQ(all["files"], json::array({to}));
  const auto keys = keys_of(all);
  EXPECT_THAT(keys, ::testing::Contains("pan_tilt_units.mast"));
  EXPECT_THAT(keys, ::testing::Contains("pairs.narrow"));
  EXPECT_THAT(keys, ::testing::Contains("cameras.wide_left.name"));
  EXPECT_THAT(keys, Not(::testing::Contains("cameras.wide_right.place"))) << "at the angles of rest";
  EXPECT_THAT(keys, Not(::testing::Contains("body")));
  const json gone = {{"key", "pairs.narrow"}, {"text", "the pair is missing"}};
  EXPECT_THAT(all["lost"], ::testing::Contains(gone));
  // Both files are named.
  const auto two = run_program({"rig", "convert", rover(), folder.path() + "/pair.tsai", "--pair", "wide", "--json"});
  ASSERT_EQ(two.exit_code, 0) << two.err;
  EXPECT_EQ(json::parse(two.out)["files"],
            json::array({folder.path() + "/pair_left.tsai", folder.path() + "/pair_right.tsai"}));
}

TEST(RigConvert, AMaskIsFoundFromTheNewFileToo) {
  const testing::TemporaryFolder folder;
  std::string text = content_of(testing::source_folder() + "/config/rigs/generic_pair.yaml");
  text.replace(text.find("    axes:"), 0, "    self_mask: masks/left.png\n");
  const std::string from = folder.write("a/rig.yaml", text), to = folder.path() + "/b/c/rig.yaml";
  const auto result = run_program({"rig", "convert", from, to});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("nothing lost"));
  EXPECT_THAT(content_of(to), HasSubstr("self_mask: \"../../a/masks/left.png\""));
  // One that is named from the root stays.
  text.replace(text.find("masks/left.png"), 0, "/from/the/root/");
  EXPECT_EQ(run_program({"rig", "convert", folder.write("a/rig.yaml", text), to, "--force"}).exit_code, 0);
  EXPECT_THAT(content_of(to), HasSubstr("self_mask: \"/from/the/root/masks/left.png\""));
}

// ".." is relative to the target of a symbolic link, not to the folder of the link.
TEST(RigConvert, AMaskIsFoundThroughLinks) {
  const testing::TemporaryFolder folder;
  std::string text = content_of(testing::source_folder() + "/config/rigs/generic_pair.yaml");
  text.replace(text.find("    axes:"), 0, "    self_mask: left.png\n");
  const std::string from = folder.write("a/rig.yaml", text);
  folder.write("a/left.png", "an image");
  std::filesystem::create_directories(folder.path() + "/real/deep");
  std::filesystem::create_directory_symlink("real/deep", folder.path() + "/link");
  const auto result = run_program({"rig", "convert", from, folder.path() + "/link/rig.yaml"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const std::string there = content_of(folder.path() + "/link/rig.yaml");
  EXPECT_THAT(there, HasSubstr("self_mask: \"../../a/left.png\""));
  EXPECT_TRUE(std::filesystem::exists(folder.path() + "/link/../../a/left.png"));
  const auto back = run_program({"rig", "convert", folder.path() + "/link/rig.yaml", folder.path() + "/back.yaml"});
  EXPECT_EQ(back.exit_code, 0) << back.err;
  EXPECT_THAT(content_of(folder.path() + "/back.yaml"), HasSubstr("self_mask: \"a/left.png\""));
}

TEST(RigConvert, OnePairOfMany) {
  const testing::TemporaryFolder folder;
  const std::string to = folder.path() + "/narrow.yml";
  const auto all = run_program({"rig", "convert", rover(), to});
  EXPECT_EQ(all.exit_code, 4);
  EXPECT_THAT(all.err, HasSubstr("opencv holds one pair, this rig has 2 (choose one with --pair)"));
  EXPECT_FALSE(std::filesystem::exists(to));
  const auto one = run_program({"rig", "convert", rover(), to, "--pair", "narrow"});
  EXPECT_EQ(one.exit_code, 0) << one.err;
  EXPECT_THAT(one.out, HasSubstr("pairs.wide: excluded by --pair"));
  EXPECT_THAT(one.out, HasSubstr("cameras.wide_left: excluded by --pair"));
  EXPECT_EQ(run_program({"rig", "convert", rover(), to, "--pair", "top", "--force"}).exit_code, 2);
}

TEST(RigConvert, FilesThatAreThereAreKept) {
  const testing::TemporaryFolder folder;
  const std::string kitti = folder.write("calib.txt", kKitti), to = folder.write("rig.yaml", "mine");
  const auto kept = run_program({"rig", "convert", kitti, to, "--size-px", "640,480"});
  EXPECT_EQ(kept.exit_code, 5);
  EXPECT_THAT(kept.err, HasSubstr("rig.yaml: exists already (--force replaces it)"));
  EXPECT_EQ(content_of(to), "mine");
  EXPECT_EQ(run_program({"rig", "convert", kitti, to, "--size-px", "640,480", "--force"}).exit_code, 0);
  EXPECT_NE(content_of(to), "mine");
  // Of two files the second one is there: the first one is not written either.
  const std::string right = folder.write("pair_right.tsai", "mine");
  EXPECT_EQ(run_program({"rig", "convert", to, folder.path() + "/pair.tsai"}).exit_code, 5);
  EXPECT_FALSE(std::filesystem::exists(folder.path() + "/pair_left.tsai"));
  EXPECT_EQ(content_of(right), "mine");
}

// What a reader has no place for is as lost as what a writer drops.
TEST(RigConvert, WhatTheReaderLeavesOutIsLost) {
  const testing::TemporaryFolder folder;
  const std::string rows = "    - [1, 0, 0, 0]\n    - [0, 1, 0, 0]\n    - [0, 0, 1, 0]\n    - [0, 0, 0, 1]\n";
  const std::string camera =
      "    camera_model: pinhole\n    intrinsics: [500, 500, 320, 240]\n    distortion_model: none\n"
      "    distortion_coeffs: []\n    resolution: [640, 480]\n";
  std::string link = rows;
  link.replace(link.find("1, 0, 0, 0"), 10, "1, 0, 0, -1");
  const std::string chain = folder.write(
      "camchain.yaml", "cam0:\n    timeshift_cam_imu: 0.0123\n" + camera + "cam1:\n    T_cn_cnm1:\n" + link + camera);
  const auto words = run_program({"rig", "convert", chain, folder.path() + "/a.yaml"});
  EXPECT_EQ(words.exit_code, 0) << words.err;
  EXPECT_THAT(words.out, HasSubstr("lost:\n  cam0.timeshift_cam_imu: the camera's clock is 0.0123 s off the IMU's\n"));
  const auto result = run_program({"rig", "convert", chain, folder.path() + "/b.yaml", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json all = json::parse(result.out);
  EXPECT_THAT(keys_of(all), ::testing::ElementsAre("cam0.timeshift_cam_imu"));
  EXPECT_EQ(all["body"], "the left camera, turned to x forward, y left, z up");
  EXPECT_EQ(all["notes"], json::array({"body: the left camera, turned to x forward, y left, z up"}));
  const auto of_rig = run_program({"rig", "convert", folder.path() + "/b.yaml", folder.path() + "/c.yaml", "--json"});
  EXPECT_EQ(json::parse(of_rig.out)["body"], nullptr) << "rig.yaml says it itself";
}

// A name that would be read as another format is refused before anything is touched.
TEST(RigConvert, NamesThatMeanAnotherFormatAreRefused) {
  const testing::TemporaryFolder folder;
  const std::string rig = testing::source_folder() + "/config/rigs/generic_pair.yaml";
  const std::pair<const char*, const char*> names[] = {
      {"out.xml", "kalibr"}, {"out.cahvor", "tsai"},          {"out.tsai", "rig.yaml"},  {"out.cameramodel", "opencv"},
      {"x,y,z.yaml", "ros"}, {"x.cahvor,x.cahvor", "cahvor"}, {"l.cahv,r.cahv", "mrcal"}};
  for (const auto& [name, format] : names) {
    const std::string old = folder.write(name, "mine");
    const auto result = run_program({"rig", "convert", rig, old, "--to", format, "--force"});
    EXPECT_EQ(result.exit_code, 2) << name << ": " << result.err;
    EXPECT_EQ(content_of(old), "mine") << name;
  }
  const auto result = run_program({"rig", "convert", rig, folder.path() + "/out.xml", "--to", "kalibr", "--force"});
  EXPECT_THAT(result.err, HasSubstr("out.xml: a file of this name would be read as opencv, not as kalibr"));
  for (const char* name : {"a.yaml", "b.odd", "c"}) {
    const std::string to = folder.path() + "/" + name;
    EXPECT_EQ(run_program({"rig", "convert", rig, to, "--to", "kalibr"}).exit_code, 0) << name;
  }
}

TEST(RigConvert, AllFilesAreWrittenOrNone) {
  const testing::TemporaryFolder folder;
  const std::string rig = testing::source_folder() + "/config/rigs/generic_pair.yaml";
  folder.write("p_right.cahvor/inside", "x");
  const auto result = run_program({"rig", "convert", rig, folder.path() + "/p.cahvor", "--force"});
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_THAT(result.err, HasSubstr("p_right.cahvor"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() + "/p_left.cahvor"));
}

// EuRoC's reader takes every camera of the folder.
TEST(RigConvert, CamerasThatLieThereAreTold) {
  const testing::TemporaryFolder folder;
  const std::string rig = testing::source_folder() + "/config/rigs/generic_pair.yaml", to = folder.path() + "/mav0";
  ASSERT_EQ(run_program({"rig", "convert", rig, to, "--json"}).exit_code, 0);
  std::filesystem::create_directories(to + "/cam2");
  std::filesystem::copy_file(to + "/cam0/sensor.yaml", to + "/cam2/sensor.yaml");
  const auto result = run_program({"rig", "convert", rig, to, "--json", "--force"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(keys_of(json::parse(result.out)), ::testing::Contains("cameras.cam2"));
  folder.write("mav0/cam2/sensor.yaml", "noise");
  const std::string before = content_of(to + "/cam0/sensor.yaml");
  const auto broken = run_program({"rig", "convert", rover(), to, "--pair", "narrow", "--force"});
  EXPECT_NE(broken.exit_code, 0);
  EXPECT_THAT(broken.err, HasSubstr(to + "/cam2/sensor.yaml"));
  EXPECT_EQ(content_of(to + "/cam0/sensor.yaml"), before);
}

TEST(RigConvert, ASizeThatTheFilesContradictIsRefused) {
  const testing::TemporaryFolder folder;
  const std::string rig = testing::source_folder() + "/config/rigs/generic_pair.yaml";
  const auto result = run_program({"rig", "convert", rig, folder.path() + "/a.yml", "--size-px", "320,240"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--size-px: contradicts the files: camera left has "));
}

TEST(RigConvert, ExitCodesAsDocumented) {
  const testing::TemporaryFolder folder;
  const std::string kitti = folder.write("calib.txt", kKitti), to = folder.path() + "/out.yaml";
  EXPECT_EQ(run_program({"rig", "convert", folder.path() + "/none.yaml", to}).exit_code, 3);
  EXPECT_EQ(run_program({"rig", "convert", kitti + "," + folder.path() + "/none.tsai", to}).exit_code, 3);
  EXPECT_EQ(run_program({"rig", "convert", kitti}).exit_code, 2);
  EXPECT_EQ(run_program({"rig", "convert", kitti, folder.path() + "/x.odd", "--size-px", "640,480"}).exit_code, 2);
  const auto no_size = run_program({"rig", "convert", kitti, to});
  EXPECT_EQ(no_size.exit_code, 4);
  EXPECT_THAT(no_size.err, HasSubstr("--size-px"));
  const auto noise = run_program({"rig", "convert", folder.write("x.cahvor", "noise"), to});
  EXPECT_EQ(noise.exit_code, 4);
  EXPECT_THAT(noise.err, HasSubstr("x.cahvor"));
  const auto unwritable = run_program({"rig", "convert", kitti, "/proc/none/rig.yaml", "--size-px", "640,480"});
  EXPECT_EQ(unwritable.exit_code, 5) << unwritable.err;
  testing::ProgramLimits full_disk;
  full_disk.largest_file_bytes = 100;
  const auto full = run_program({"rig", "convert", kitti, to, "--size-px", "640,480"}, full_disk);
  EXPECT_EQ(full.exit_code, 5) << full.err;
  EXPECT_FALSE(std::filesystem::exists(to));
}

TEST(RigConvert, RealCalibrations) {
  const std::string data = testing::data_folder();
  if (!std::filesystem::exists(data + "/k10_pair"))
    GTEST_SKIP() << "no real recordings; SPARTAN_DATA says where they are";
  const testing::TemporaryFolder folder;
  for (const char* from : {"k10_pair", "kitti_06", "kitti_0013/calib_cam_to_cam.txt", "euroc_v101"}) {
    const std::string to = folder.path() + "/" + std::filesystem::path(from).stem().string() + "_camchain.yaml";
    const auto result = run_program({"rig", "convert", data + "/" + from, to});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    // KITTI raw knows the cameras as they were before rectification, and colour cameras.
    EXPECT_THAT(result.out,
                HasSubstr(std::string(from).starts_with("kitti_0013") ? "lost:\n  P_rect_02: a colour camera"
                                                                      : "nothing lost"));
  }
}

}  // namespace
}  // namespace spartan
