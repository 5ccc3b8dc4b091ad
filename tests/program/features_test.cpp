// spartan features compare.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "program.h"
#include "spartan/image_io/image_io.h"
#include "spartan/odometry/view_matching.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::run_program;

std::string image_of(int side) {
  return testing::small_runs_folder() + "/drive/image_" + std::to_string(side) + "/000000.png";
}

testing::ProgramResult compare(std::vector<std::string> words) {
  words.insert(words.begin(), {"features", "compare"});
  return run_program(words);
}

json compared(std::vector<std::string> words) {
  words.insert(words.end(), {"--json", "--repetitions", "1"});
  const auto result = compare(std::move(words));
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return json::parse(result.out);
}

json detector_of(const json& view, const std::string& name) {
  for (const json& detector : view["detectors"])
    if (detector["name"] == name) return detector;
  ADD_FAILURE() << "no detector " << name;
  return {};
}

TEST(FeaturesCompare, ComparesAllDetectorsOnFourViewsOfOneImage) {
  const json all = compared({image_of(0), "--features", "200"});
  ASSERT_EQ(all["views"].size(), 4U);
  for (const json& view : all["views"]) {
    std::vector<std::string> names;
    for (const json& detector : view["detectors"]) {
      names.push_back(detector["name"]);
      EXPECT_LE(detector["features"]["first"], 200);
      EXPECT_GT(detector["features"]["first"], 20);
      EXPECT_GE(detector["matches"], detector["correct"]);
      EXPECT_GT(detector["time_ms"], 0);
      EXPECT_GT(detector["repeatability"], 0.1);
    }
    EXPECT_THAT(names, ElementsAre("surf", "surf_oriented", "surf_refined", "harris", "orb", "sift", "akaze"));
  }
  EXPECT_EQ(all["views"][1]["rotation_deg"], 45);
  EXPECT_EQ(all["views"][2]["scale"], 0.7);
  // Upright descriptors do not survive half a right angle.
  EXPECT_LT(detector_of(all["views"][1], "surf")["matching_score"], 0.1);
  EXPECT_GT(detector_of(all["views"][1], "surf_refined")["matching_score"], 0.2);
}

TEST(FeaturesCompare, DrawsEachDetector) {
  const testing::TemporaryFolder folder;
  const auto result = compare({image_of(0), "--rotate-deg", "10", "--scale", "0.7", "--detectors", "surf,orb", "-o",
                               folder.path() + "/figures", "--repetitions", "1"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("rotation 10 deg, scale 0.7"));
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path() + "/figures"))
    names.insert(entry.path().filename().string());
  EXPECT_EQ(names, (std::set<std::string>{"rotation_10_deg_scale_0.7_orb.png", "rotation_10_deg_scale_0.7_surf.png"}));
  const auto figure = read_image(folder.path() + "/figures/rotation_10_deg_scale_0.7_surf.png");
  ASSERT_TRUE(figure.has_value());
  EXPECT_GT(figure->size().width, 500);
  EXPECT_EQ(compare({image_of(0), "--scale", "2", "-o", folder.path() + "/figures"}).exit_code, 5) << "exists";
}

TEST(FeaturesCompare, TakesAHomography) {
  const testing::TemporaryFolder folder;
  const auto image = read_gray8(image_of(0));
  ASSERT_TRUE(image.has_value());
  const TransformedView view = transform_view(image->view(), 0.1, 1.2);
  ASSERT_TRUE(write_png(folder.path() + "/b.png", std::as_const(view.image).view()).has_value());
  std::string text;
  for (int i = 0; i < 9; ++i) text += std::to_string(view.geometry.matrix(i / 3, i % 3)) + " ";
  const std::string file = folder.write("h.txt", text), wrong = folder.write("shift.txt", "1 0 40 0 1 0 0 0 1");
  const json right = compared({image_of(0), folder.path() + "/b.png", "--homography", file, "--detectors", "surf"});
  EXPECT_GT(right["views"][0]["detectors"][0]["precision"], 0.8);
  EXPECT_TRUE(right["views"][0]["rotation_deg"].is_null());
  const json shifted = compared({image_of(0), folder.path() + "/b.png", "--homography", wrong, "--detectors", "surf"});
  EXPECT_LT(shifted["views"][0]["detectors"][0]["precision"], 0.2);
  const auto damaged = compare({image_of(0), folder.path() + "/b.png", "--homography", folder.write("bad.txt", "1 2")});
  EXPECT_EQ(damaged.exit_code, 3);
  EXPECT_THAT(damaged.err, HasSubstr("bad.txt: has 2 numbers"));
}

TEST(FeaturesCompare, ChecksAStereoPairByItsRowsOrByAnEstimate) {
  for (const bool rectified : {true, false}) {
    std::vector<std::string> words{image_of(0), image_of(1), "--detectors", "surf,sift"};
    if (rectified) words.emplace_back("--rectified");
    const json pair = compared(words);
    EXPECT_EQ(pair["views"][0]["geometry"], rectified ? "rectified" : "estimated");
    for (const json& detector : pair["views"][0]["detectors"]) {
      EXPECT_GT(detector["precision"], 0.8) << detector;
      EXPECT_TRUE(detector["repeatability"].is_null());
    }
    EXPECT_THAT(pair["reasons"]["repeatability"], HasSubstr("line"));
  }
}

TEST(FeaturesCompare, IsIdenticalForAnyNumberOfThreads) {
  std::vector<json> results;
  for (const char* threads : {"1", "2"}) {
    json result = compared({image_of(0), image_of(1), "--threads", threads});
    for (json& detector : result["views"][0]["detectors"]) detector.erase("time_ms");
    results.push_back(std::move(result));
  }
  EXPECT_EQ(results[0], results[1]);
}

TEST(FeaturesCompare, RefusesWhatItCannotCompare) {
  const testing::TemporaryFolder folder;
  ASSERT_TRUE(write_png(folder.path() + "/flat.png", Image<std::uint8_t>(200, 100, 77).view()).has_value());
  const std::string flat = folder.path() + "/flat.png", text = folder.write("text.png", "no image");
  struct Refused {
    std::vector<std::string> words;
    int exit_code;
    std::string message;
  };
  for (const Refused& refused :
       std::vector<Refused>{{{folder.path() + "/none.png"}, 3, "none.png"},
                            {{text}, 3, "text.png"},
                            {{image_of(0), text}, 3, "text.png"},
                            {{image_of(0), flat}, 3, "too few matches agree"},
                            {{image_of(0), flat, "--rectified"}, 3, "rectified images of a pair have one size"},
                            {{image_of(0), image_of(1), "--homography", folder.path() + "/none.txt"}, 3, "none.txt"},
                            {{image_of(0), image_of(1), "--scale", "0.5"}, 2, "give one of them"},
                            {{image_of(0), "--rectified"}, 2, "need B"},
                            {{image_of(0), image_of(1), "--rectified", "--homography", text}, 2, "excludes"},
                            {{image_of(0), "--scale", "0.05"}, 2, "cannot be scaled"},
                            {{image_of(0), "--detectors", "brisk"}, 2, "brisk"},
                            {{image_of(0), "--features", "3"}, 2, "--features"},
                            {{image_of(0), "--set", "odometry.detection.surf.octaves=9"}, 2, "octaves"},
                            {{image_of(0), "--memory", "1"}, 5, "--memory"},
                            {{}, 2, "required"}}) {
    const auto result = compare(refused.words);
    EXPECT_EQ(result.exit_code, refused.exit_code) << result.err;
    EXPECT_THAT(result.err, HasSubstr(refused.message));
  }
  // No features at all are a result.
  EXPECT_EQ(compare({flat, "--scale", "0.7", "--repetitions", "1"}).exit_code, 0);
}

}  // namespace
}  // namespace spartan
