// `spartan rig inspect` with images of a drive of known calibration.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "program.h"
#include "small_drive.h"
#include "spartan/image_io/image_io.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using nlohmann::json;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::run_program;

// A drive over a synthetic world, whose calibration is right to the last digit.
class RigInspectImages : public ::testing::Test {
 protected:
  std::string image(int side) const { return fmt::format("{}/image_{}/000000.png", drive_, side); }
  testing::ProgramResult inspect(const std::string& rig, std::vector<std::string> more) const {
    std::vector<std::string> words{"rig", "inspect", rig};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words);
  }
  // The pair in the JSON, for a rig with the right camera at x_m.
  json pair_with_right_camera_at(double x_m) const {
    const auto result = inspect(folder_.write("rig.yaml", fmt::format(kRig, x_m)), {image(0), image(1), "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out)["pairs"]["stereo"];
  }
  static std::vector<std::string> ids(const json& pair) {
    std::vector<std::string> found;
    for (const json& finding : pair["findings"]) found.push_back(finding["id"]);
    return found;
  }

  static constexpr const char* kRig =
      "schema: 1\n"
      "cameras:\n"
      "  left: {{size_px: [320, 240], model: pinhole, focal_px: [260, 260], centre_px: [159.5, 119.5], axes: optical, "
      "translation_m: [0, 0, 0]}}\n"
      "  right: {{size_px: [320, 240], model: pinhole, focal_px: [260, 260], centre_px: [159.5, 119.5], axes: optical, "
      "translation_m: [{}, 0, 0]}}\n"
      "pairs:\n  stereo: {{left: left, right: right}}\n";
  testing::TemporaryFolder folder_;
  const std::string drive_ = testing::small_runs_folder() + "/drive";  // only read
};

TEST_F(RigInspectImages, AcceptsAGoodPair) {
  const auto result = inspect(drive_ + "/calib.txt", {image(0), image(1), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json pair = json::parse(result.out)["pairs"].front();
  EXPECT_EQ(pair["verdict"], "good");
  EXPECT_EQ(ids(pair), std::vector<std::string>());
  EXPECT_LT(pair["row_error_px"]["after"]["mean"], 0.2);
  EXPECT_LT(pair["row_error_px"]["after"]["p95"], 0.6);
  EXPECT_NEAR(pair["corrections"]["pitch_deg"], 0, 0.1);
  EXPECT_NEAR(pair["corrections"]["focal_ratio"], 1, 0.01);
  EXPECT_GT(pair["inliers"], 50);
  EXPECT_FALSE(pair["row_error_map"].empty());
}

TEST_F(RigInspectImages, ThreadsDoNotMatter) {
  const std::vector<std::string> words{image(0), image(1), "--json", "--threads"};
  auto one = words, two = words;
  one.emplace_back("1");
  two.emplace_back("2");
  EXPECT_EQ(inspect(drive_ + "/calib.txt", one).out, inspect(drive_ + "/calib.txt", two).out);
}

TEST_F(RigInspectImages, TakesFramesFromARecordingOrAPattern) {
  const auto recording = inspect(drive_ + "/calib.txt", {"--recording", drive_, "--json"});
  ASSERT_EQ(recording.exit_code, 0) << recording.err;
  const auto pattern = inspect(drive_ + "/calib.txt", {drive_ + "/image_0/*.png", drive_ + "/image_1", "--json"});
  ASSERT_EQ(pattern.exit_code, 0) << pattern.err;
  const auto single = inspect(drive_ + "/calib.txt", {image(0), image(1), "--json"});
  const auto matches = [](const std::string& text) { return json::parse(text)["pairs"].front()["matches"].get<int>(); };
  EXPECT_GT(matches(recording.out), matches(single.out));
  EXPECT_NEAR(matches(pattern.out), matches(recording.out),
              0.05 * matches(recording.out));  // its contrast is stretched
}

TEST_F(RigInspectImages, WithoutACalibration) {
  const auto result = inspect("-", {image(0), image(1)});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("no calibration"));
  EXPECT_THAT(result.out, HasSubstr("as rectified images: good"));
  const auto swapped = inspect("-", {image(1), image(0), "--json"});
  EXPECT_EQ(ids(json::parse(swapped.out)["pairs"].front()), std::vector<std::string>{"swapped_eyes"});
}

// The rig has the right camera rotated by 0.5° up and 1° clockwise, with a focal length 1 % too large.
TEST_F(RigInspectImages, PrintsTheCorrectionOfTheRightCamera) {
  std::string text = fmt::format(kRig, 0.12);
  text.replace(text.rfind("axes: optical"), 0, "roll_pitch_yaw_deg: [0.5, 0, 1], ");
  text.replace(text.rfind("[260, 260]"), 10, "[262.6, 262.6]");
  const std::string rig = folder_.write("rig.yaml", text);
  const auto result = inspect(rig, {image(0), image(1), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json pair = json::parse(result.out)["pairs"]["stereo"];
  EXPECT_NEAR(pair["corrections"]["pitch_deg"], -0.5, 0.1);
  EXPECT_NEAR(pair["corrections"]["roll_deg"], -1, 0.1);
  EXPECT_NEAR(pair["corrections"]["focal_ratio"], 1 / 1.01, 0.002);
  for (const char* key : {"pitch_deg", "roll_deg", "yaw_deg", "focal_ratio"}) {
    EXPECT_GT(pair["corrections"]["sigma"][key], 0) << key;
    EXPECT_LT(pair["corrections"]["sigma"][key], 0.5) << key;
  }
  const json& rows = pair["row_error_px"];
  EXPECT_LT(rows["before"]["mean"], 0.2) << "the images are rectified";
  EXPECT_GT(rows["after"]["mean"], 1.5);
  EXPECT_LT(rows["corrected"]["mean"], 0.2);
  double right_px = 0, low_px = 0;
  for (const json& cell : pair["row_error_map"]) {
    right_px = std::max<double>(right_px, cell["x_px"]);
    low_px = std::max<double>(low_px, cell["y_px"]);
  }
  EXPECT_EQ(right_px, 300) << "eight cells over 320 px";
  EXPECT_EQ(low_px, 220) << "six over 240 px";

  const std::string words = inspect(rig, {image(0), image(1)}).out;
  const std::string figure = "[0-9.]+° ± [0-9.]+° ";
  EXPECT_THAT(words, ContainsRegex("mean row error unrectified 0\\.[01]"));
  EXPECT_THAT(words, ContainsRegex("rotation 0\\.[45]" + figure + "down, "));
  EXPECT_THAT(words,
              ContainsRegex(", [01]\\." + figure + "counter-clockwise; focal length -(0\\.[89]|1\\.[01])[0-9]* % ± 0"));
  for (const std::string& id : ids(pair)) EXPECT_THAT(words, HasSubstr("pair stereo: finding " + id + ": "));
}

TEST_F(RigInspectImages, ChecksTheRequestedPairAndFrames) {
  const auto matches = [&](const std::vector<std::string>& words) {
    const auto result = inspect(drive_ + "/calib.txt", words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out)["pairs"].front()["matches"].get<int>();
  };
  const auto frames = [&](const char* most) {
    return matches({drive_ + "/image_0", drive_ + "/image_1", "--frames", most, "--json"});
  };
  const int first = matches({image(0), image(1), "--json"});
  const int last = matches({drive_ + "/image_0/000013.png", drive_ + "/image_1/000013.png", "--json"});
  EXPECT_EQ(frames("1"), first);
  EXPECT_EQ(frames("2"), first + last);
  EXPECT_NEAR(matches({"--recording", drive_, "--frames", "1", "--json"}), first, 0.05 * first);

  const std::string rig = folder_.write("rig.yaml", fmt::format(kRig, 0.12) + "  second: {left: left, right: right}\n");
  const json pairs = json::parse(inspect(rig, {image(0), image(1), "--pair", "second", "--json"}).out)["pairs"];
  EXPECT_TRUE(pairs["second"].contains("verdict"));
  EXPECT_FALSE(pairs["stereo"].contains("verdict"));
}

// The cameras of the rig are exchanged, and so are the images; mask paths are relative to the new file.
TEST_F(RigInspectImages, AppliesExchangedCameras) {
  std::string text = fmt::format(kRig, 0.12);
  text.replace(text.find("{left: left, right: right}"), 26, "{left: right, right: left}");
  text.replace(text.find("axes: optical"), 0, "self_mask: masks/left.png, ");
  const std::string rig = folder_.write("a/rig.yaml", text), corrected = folder_.path() + "/corrected.yaml";
  const auto result = inspect(rig, {image(1), image(0), "--force", "--apply", corrected, "--json"});
  EXPECT_EQ(ids(json::parse(result.out)["pairs"]["stereo"]), std::vector<std::string>{"swapped_eyes"});
  const auto again = inspect(corrected, {image(0), image(1), "--json"});
  EXPECT_EQ(json::parse(again.out)["pairs"]["stereo"]["verdict"], "good") << again.out;
  EXPECT_THAT(testing::content_of(corrected), HasSubstr("self_mask: \"a/masks/left.png\""));
}

std::string replaced_everywhere(std::string text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

TEST_F(RigInspectImages, SaysWhatTheWrittenFileIs) {
  const std::string corrected = folder_.path() + "/corrected.yaml";
  const auto applied = [&](const std::string& rig, const std::string& left, const std::string& right) {
    const auto result = inspect(rig, {left, right, "--force", "--apply", corrected});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  const std::string rig = folder_.write("rig.yaml", fmt::format(kRig, 0.12));
  EXPECT_THAT(applied(rig, image(0), image(1)),
              HasSubstr("\nnothing needs correction: " + corrected + " holds the given rig\n"));
  testing::write_gray_png(folder_.path() + "/gray.png", 320, 240);
  const std::string gray = folder_.path() + "/gray.png";
  EXPECT_THAT(applied(rig, gray, gray),
              HasSubstr("\nno pair could be checked: " + corrected + " holds the given rig\n"));
  EXPECT_THAT(applied("-", gray, gray),
              HasSubstr("\nno pair could be checked: " + corrected + " holds the assumed rig\n"));
  const std::string above = replaced_everywhere(fmt::format(kRig, 0.5), "[0.5, 0, 0]", "[0, 0.12, 0]");
  EXPECT_THAT(applied(folder_.write("above.yaml", above), image(0), image(1)),
              HasSubstr("\nno pair could be checked: "));
  const std::string large = folder_.write("large.yaml", fmt::format(kRig, 4.2));
  EXPECT_THAT(applied(large, image(0), image(1)),
              HasSubstr("\nno finding can be corrected: " + corrected + " holds the given rig\n"));
  const std::string inverse = folder_.write("inverse.yaml", fmt::format(kRig, -0.12));
  EXPECT_THAT(applied(inverse, image(0), image(1)), HasSubstr("\nthe corrected rig: " + corrected + "\n"));
}

// A calibration of images twice as large, with a mask of that size.
TEST_F(RigInspectImages, NotesMasksOfAnotherSize) {
  std::string text = replaced_everywhere(fmt::format(kRig, 0.12), "[320, 240]", "[640, 480]");
  text = replaced_everywhere(replaced_everywhere(text, "[260, 260]", "[520, 520]"), "[159.5, 119.5]", "[319.5, 239.5]");
  text.replace(text.find("axes: optical"), 0, "self_mask: mask.png, ");
  const std::string rig = folder_.write("rig.yaml", text), corrected = folder_.path() + "/corrected.yaml";
  const auto printed = [&] { return inspect(rig, {image(0), image(1), "--force", "--apply", corrected}).out; };
  const std::string sentence =
      "\ncamera left: its self-mask mask.png does not have the corrected size 320 x 240 px: replace it\n";
  testing::write_gray_png(folder_.path() + "/mask.png", 640, 480);
  EXPECT_THAT(printed(), HasSubstr(sentence));
  EXPECT_THAT(inspect(rig, {image(0), image(1), "--force", "--apply", corrected, "--json"}).err,
              HasSubstr("camera left: its self-mask mask.png"));
  testing::write_gray_png(folder_.path() + "/mask.png", 320, 240);
  EXPECT_THAT(printed(), Not(HasSubstr(sentence)));
}

// Two pairs of a recording that share the right camera. The rig has the left camera of the first pair 0.5° too far up;
// the second pair is sound, and both are when that is corrected.
TEST_F(RigInspectImages, CorrectsPairsThatShareACamera) {
  const char* camera =
      "  {}: {{size_px: [320, 240], model: pinhole, focal_px: [260, 260], centre_px: [159.5, 119.5], axes: optical, "
      "roll_pitch_yaw_deg: [{}, 0, 0], translation_m: [{}, 0, 0]}}\n";
  const auto rig = [&](double left_up_deg) {
    return "schema: 1\ncameras:\n" + fmt::format(fmt::runtime(camera), "left", left_up_deg, 0) +
           fmt::format(fmt::runtime(camera), "other", 0, 0) + fmt::format(fmt::runtime(camera), "right", 0, 0.12) +
           "pairs:\n  first: {left: left, right: right}\n  second: {left: other, right: right, for_odometry: false}\n";
  };
  folder_.write("recording/rig.yaml", rig(0));
  folder_.write("recording/recording.yaml", "schema: 1\n");
  folder_.write("recording/frames.csv",
                "frame_id,position_id,pair,left_stamp_ns,right_stamp_ns,left,right,pan_deg,tilt_deg,exposure_us,gain,"
                "bits\n0,0,first,1000,1000,l.png,r.png,0,0,0,0,8\n1,0,second,1000,1000,l.png,r.png,0,0,0,0,8\n");
  folder_.write("recording/l.png", testing::content_of(image(0)));
  folder_.write("recording/r.png", testing::content_of(image(1)));
  const std::string recording = folder_.path() + "/recording", corrected = folder_.path() + "/corrected.yaml";
  const auto pairs = [&](const std::string& of, std::vector<std::string> more) {
    more.insert(more.end(), {"--recording", recording, "--json"});
    const auto result = inspect(of, std::move(more));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out)["pairs"];
  };
  const json found = pairs(folder_.write("off.yaml", rig(0.5)), {"--force", "--apply", corrected});
  EXPECT_EQ(ids(found["first"]), std::vector<std::string>{"row_offset"});
  EXPECT_EQ(found["second"]["verdict"], "good");
  const json again = pairs(corrected, {});
  EXPECT_EQ(again["first"]["verdict"], "good") << again["first"]["findings"];
  EXPECT_EQ(again["second"]["verdict"], "good") << again["second"]["findings"];
}

// Plain lines in a pipe, as other commands print; a single frame shows no progress.
TEST_F(RigInspectImages, ShowsItsProgress) {
  const auto shown = [&](std::vector<std::string> words) {
    return inspect(drive_ + "/calib.txt", std::move(words)).err;
  };
  EXPECT_THAT(shown({"--recording", drive_, "--frames", "3"}),
              ContainsRegex("0/3 frames of pair .*3/3 frames of pair .* matched, checking the calibration"));
  EXPECT_EQ(shown({"--recording", drive_, "--frames", "3", "-q"}), "");
  EXPECT_EQ(shown({image(0), image(1)}), "");
}

// Three pairs of images on top of each other: as taken, rectified as given, corrected. The one of two frames is drawn
// that shows more.
TEST_F(RigInspectImages, DrawsTheRowsOfBothCameras) {
  std::string text = fmt::format(kRig, 0.12);
  text.replace(text.rfind("axes: optical"), 0, "roll_pitch_yaw_deg: [1, 0, 2], ");
  for (const int side : {0, 1}) {
    const std::string name = fmt::format("side_{}/", side);
    testing::write_gray_png(folder_.file(name + "a.png"), 320, 240);
    folder_.write(name + "b.png", testing::content_of(image(side)));
    testing::write_gray_png(folder_.file(name + "c.png"), 320, 240);
  }
  const std::string drawn = folder_.path() + "/rows.png", rig = folder_.write("rig.yaml", text);
  ASSERT_EQ(inspect(rig, {folder_.path() + "/side_0", folder_.path() + "/side_1", "--figure", drawn}).exit_code, 0);
  const auto read = read_image(drawn);
  ASSERT_TRUE(read) << read.error().message();
  ASSERT_EQ(read->size(), (ImageSize{640, 3 * (240 + 22)}));
  const auto pixels = read->as<Rgb8>();
  // How far the gray of a strip's side is from its image, and how much of it is red: rows 3 px apart.
  const auto compare = [&](int strip, int side) {
    const auto taken = read_gray8(image(side)).value();
    double difference = 0;
    int gray = 0, red = 0;
    for (int y = 0; y < 240; ++y) {
      for (int x = 0; x < 320; ++x) {
        const Rgb8 p = pixels(320 * side + x, 262 * strip + 22 + y);
        red += p.r > 200 && p.g < 50 ? 1 : 0;
        if (p.r != p.g || p.g != p.b) continue;
        difference += std::abs(p.r - taken(x, y));
        ++gray;
      }
    }
    return std::pair{difference / gray, red};
  };
  EXPECT_GT(compare(1, 0).second, 3000) << "arrows";
  for (const int side : {0, 1}) {
    EXPECT_LT(compare(0, side).first, 0.01) << side;  // rings at wrong matches are gray too
    EXPECT_GT(compare(1, side).second, 5 * compare(0, side).second) << side;
    EXPECT_GT(compare(1, side).second, 5 * compare(2, side).second) << side;
  }
}

TEST_F(RigInspectImages, NamesInjectedFaultsAndCorrectsThem) {
  EXPECT_EQ(ids(pair_with_right_camera_at(0.12)), std::vector<std::string>());
  // With two equal cameras the finding is ambiguous.
  EXPECT_EQ(ids(pair_with_right_camera_at(-0.12)), (std::vector<std::string>{"inverse_transform", "swapped_eyes"}));
  EXPECT_EQ(ids(pair_with_right_camera_at(120)), std::vector<std::string>{"baseline_unit"});
  const std::string rig = folder_.write("rig.yaml", fmt::format(kRig, -0.12)),
                    corrected = folder_.path() + "/corrected.yaml";
  const std::string drawn = folder_.path() + "/rows.png";
  ASSERT_EQ(inspect(rig, {image(0), image(1), "--force", "--apply", corrected, "--figure", drawn}).exit_code, 0);
  const auto again = inspect(corrected, {image(0), image(1), "--json"});
  EXPECT_EQ(json::parse(again.out)["pairs"]["stereo"]["verdict"], "good") << again.out;
  const auto figure = read_image(drawn);
  ASSERT_TRUE(figure) << figure.error().message();
  EXPECT_EQ(figure->width(), 640);
}

TEST_F(RigInspectImages, BadInputIsNamed) {
  const std::string rig = drive_ + "/calib.txt";
  EXPECT_EQ(inspect(rig, {image(0)}).exit_code, 2);
  EXPECT_EQ(inspect("-", {}).exit_code, 2);
  EXPECT_EQ(inspect(rig, {"--apply", folder_.path() + "/x.yaml"}).exit_code, 2);
  EXPECT_EQ(inspect(rig, {image(0), image(1), "--pair", "none"}).exit_code, 2);
  EXPECT_EQ(inspect(rig, {image(0), folder_.path() + "/none.png"}).exit_code, 3);
  EXPECT_EQ(inspect(rig, {drive_ + "/image_0/none*", drive_ + "/image_1"}).exit_code, 3);
  const auto uneven = inspect(rig, {drive_ + "/image_0", image(1)});
  EXPECT_EQ(uneven.exit_code, 3);
  EXPECT_THAT(uneven.err, HasSubstr("14 left and 1 right"));
  EXPECT_EQ(inspect(rig, {"--recording", folder_.path() + "/none"}).exit_code, 3);
  EXPECT_EQ(inspect(rig, {image(0), image(1), "--recording", drive_}).exit_code, 2);
  testing::write_gray_png(folder_.path() + "/small.png", 160, 120);
  const auto odd = inspect(rig, {image(0), folder_.path() + "/small.png"});
  EXPECT_EQ(odd.exit_code, 3);
  EXPECT_THAT(odd.err, HasSubstr("small.png: is 160 x 120 px"));
  EXPECT_EQ(inspect(rig, {image(0), image(1), "--apply", folder_.path() + "/no/such/x.yaml"}).exit_code, 5);
  testing::write_gray_png(folder_.path() + "/gray.png", 320, 240);
  const auto gray = inspect(rig, {folder_.path() + "/gray.png", folder_.path() + "/gray.png", "--json"});
  ASSERT_EQ(gray.exit_code, 0) << gray.err;
  EXPECT_EQ(ids(json::parse(gray.out)["pairs"].front()), std::vector<std::string>{"not_enough_texture"});
  const auto text = inspect(rig, {folder_.path() + "/gray.png", folder_.path() + "/gray.png"});
  EXPECT_THAT(text.out, HasSubstr("calibration: not verified by these images"));
  EXPECT_THAT(text.out, Not(HasSubstr("calibration: bad")));
}

}  // namespace
}  // namespace spartan
