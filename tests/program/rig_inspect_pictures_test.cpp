// `spartan rig inspect` with pictures of a drive whose calibration is known, from outside.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "program.h"
#include "small_drive.h"
#include "spartan/core/image_io.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using nlohmann::json;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::run_program;

// A drive over a synthetic world, whose calibration is right to the last digit.
class RigInspectPictures : public ::testing::Test {
 protected:
  std::string picture(int eye) const { return fmt::format("{}/image_{}/000000.png", drive_, eye); }
  testing::ProgramResult inspect(const std::string& rig, std::vector<std::string> more) const {
    std::vector<std::string> words{"rig", "inspect", rig};
    words.insert(words.end(), more.begin(), more.end());
    return run_program(words);
  }
  // The pair of the answer, for a rig with the right eye's place as given.
  json pair_with_right_eye_at(double x_m) const {
    const auto told = inspect(folder_.write("rig.yaml", fmt::format(kRig, x_m)), {picture(0), picture(1), "--json"});
    EXPECT_EQ(told.exit_code, 0) << told.err;
    return json::parse(told.out)["pairs"]["stereo"];
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
  const std::string drive_ = testing::small_drive_folder();  // only read
};

TEST_F(RigInspectPictures, JudgesAGoodPair) {
  const auto told = inspect(drive_ + "/calib.txt", {picture(0), picture(1), "--json"});
  ASSERT_EQ(told.exit_code, 0) << told.err;
  const json pair = json::parse(told.out)["pairs"].front();
  EXPECT_EQ(pair["verdict"], "good");
  EXPECT_EQ(ids(pair), std::vector<std::string>());
  EXPECT_LT(pair["row_error_px"]["after"]["mean"], 0.2);
  EXPECT_LT(pair["row_error_px"]["after"]["p95"], 0.6);
  EXPECT_NEAR(pair["corrections"]["pitch_deg"], 0, 0.1);
  EXPECT_NEAR(pair["corrections"]["focal_ratio"], 1, 0.01);
  EXPECT_GT(pair["inliers"], 50);
  EXPECT_FALSE(pair["row_error_map"].empty());
}

TEST_F(RigInspectPictures, ThreadsDoNotMatter) {
  const std::vector<std::string> words{picture(0), picture(1), "--json", "--threads"};
  auto one = words, two = words;
  one.emplace_back("1");
  two.emplace_back("2");
  EXPECT_EQ(inspect(drive_ + "/calib.txt", one).out, inspect(drive_ + "/calib.txt", two).out);
}

TEST_F(RigInspectPictures, TakesShotsFromARecordingOrAPattern) {
  const auto recording = inspect(drive_ + "/calib.txt", {"--recording", drive_, "--json"});
  ASSERT_EQ(recording.exit_code, 0) << recording.err;
  const auto pattern = inspect(drive_ + "/calib.txt", {drive_ + "/image_0/*.png", drive_ + "/image_1", "--json"});
  ASSERT_EQ(pattern.exit_code, 0) << pattern.err;
  const auto single = inspect(drive_ + "/calib.txt", {picture(0), picture(1), "--json"});
  const auto matches = [](const std::string& text) { return json::parse(text)["pairs"].front()["matches"].get<int>(); };
  EXPECT_GT(matches(recording.out), matches(single.out));
  EXPECT_NEAR(matches(pattern.out), matches(recording.out),
              0.05 * matches(recording.out));  // its contrast is stretched
}

TEST_F(RigInspectPictures, WithoutACalibration) {
  const auto told = inspect("-", {picture(0), picture(1)});
  ASSERT_EQ(told.exit_code, 0) << told.err;
  EXPECT_THAT(told.out, HasSubstr("no calibration"));
  EXPECT_THAT(told.out, HasSubstr("verdict: good"));
  const auto swapped = inspect("-", {picture(1), picture(0), "--json"});
  EXPECT_EQ(ids(json::parse(swapped.out)["pairs"].front()), std::vector<std::string>{"swapped_eyes"});
}

// The right eye is said to be turned 0.5° up and 1° clockwise, with a focal length 1 % too large: the pictures want it
// back.
TEST_F(RigInspectPictures, SaysHowTheEyeWantsToBeTurned) {
  std::string text = fmt::format(kRig, 0.12);
  text.replace(text.rfind("axes: optical"), 0, "roll_pitch_yaw_deg: [0.5, 0, 1], ");
  text.replace(text.rfind("[260, 260]"), 10, "[262.6, 262.6]");
  const std::string rig = folder_.write("rig.yaml", text);
  const auto told = inspect(rig, {picture(0), picture(1), "--json"});
  ASSERT_EQ(told.exit_code, 0) << told.err;
  const json pair = json::parse(told.out)["pairs"]["stereo"];
  EXPECT_NEAR(pair["corrections"]["pitch_deg"], -0.5, 0.1);
  EXPECT_NEAR(pair["corrections"]["roll_deg"], -1, 0.1);
  EXPECT_NEAR(pair["corrections"]["focal_ratio"], 1 / 1.01, 0.002);
  for (const char* key : {"pitch_deg", "roll_deg", "yaw_deg", "focal_ratio"}) {
    EXPECT_GT(pair["corrections"]["sigma"][key], 0) << key;
    EXPECT_LT(pair["corrections"]["sigma"][key], 0.5) << key;
  }
  const json& rows = pair["row_error_px"];
  EXPECT_LT(rows["before"]["mean"], 0.2) << "the pictures are rectified";
  EXPECT_GT(rows["after"]["mean"], 1.5);
  EXPECT_LT(rows["corrected"]["mean"], 0.2);
  double right_px = 0, low_px = 0;
  for (const json& cell : pair["row_error_map"]) {
    right_px = std::max<double>(right_px, cell["x_px"]);
    low_px = std::max<double>(low_px, cell["y_px"]);
  }
  EXPECT_EQ(right_px, 300) << "eight cells over 320 px";
  EXPECT_EQ(low_px, 220) << "six over 240 px";

  const std::string words = inspect(rig, {picture(0), picture(1)}).out;
  const std::string figure = "[0-9.]+° ± [0-9.]+° ";
  EXPECT_THAT(words, ContainsRegex("rows differ as taken by 0\\.[01]"));
  EXPECT_THAT(words, ContainsRegex("turned 0\\.[45]" + figure + "down, "));
  EXPECT_THAT(words, ContainsRegex(", [01]\\." + figure +
                                   "counter-clockwise; its focal length -(0\\.[89]|1\\.[01])[0-9]* % ± 0"));
  for (const std::string& id : ids(pair)) EXPECT_THAT(words, HasSubstr("pair stereo: FOUND " + id + ": "));
}

TEST_F(RigInspectPictures, LooksAtThePairAndTheShotsThatAreAskedFor) {
  const auto matches = [&](const std::vector<std::string>& words) {
    const auto told = inspect(drive_ + "/calib.txt", words);
    EXPECT_EQ(told.exit_code, 0) << told.err;
    return json::parse(told.out)["pairs"].front()["matches"].get<int>();
  };
  const auto shots = [&](const char* most) {
    return matches({drive_ + "/image_0", drive_ + "/image_1", "--shots", most, "--json"});
  };
  const int first = matches({picture(0), picture(1), "--json"});
  const int last = matches({drive_ + "/image_0/000013.png", drive_ + "/image_1/000013.png", "--json"});
  EXPECT_EQ(shots("1"), first);
  EXPECT_EQ(shots("2"), first + last);
  EXPECT_NEAR(matches({"--recording", drive_, "--shots", "1", "--json"}), first, 0.05 * first);

  const std::string rig = folder_.write("rig.yaml", fmt::format(kRig, 0.12) + "  second: {left: left, right: right}\n");
  const json pairs = json::parse(inspect(rig, {picture(0), picture(1), "--pair", "second", "--json"}).out)["pairs"];
  EXPECT_TRUE(pairs["second"].contains("verdict"));
  EXPECT_FALSE(pairs["stereo"].contains("verdict"));
}

// The eyes of the rig are exchanged, and so are the pictures; masks are found from the new file too.
TEST_F(RigInspectPictures, AppliesExchangedEyes) {
  std::string text = fmt::format(kRig, 0.12);
  text.replace(text.find("{left: left, right: right}"), 26, "{left: right, right: left}");
  text.replace(text.find("axes: optical"), 0, "self_mask: masks/left.png, ");
  const std::string rig = folder_.write("a/rig.yaml", text), mended = folder_.path() + "/mended.yaml";
  const auto told = inspect(rig, {picture(1), picture(0), "--apply", mended, "--json"});
  EXPECT_EQ(ids(json::parse(told.out)["pairs"]["stereo"]), std::vector<std::string>{"swapped_eyes"});
  const auto again = inspect(mended, {picture(0), picture(1), "--json"});
  EXPECT_EQ(json::parse(again.out)["pairs"]["stereo"]["verdict"], "good") << again.out;
  EXPECT_THAT(testing::content_of(mended), HasSubstr("self_mask: \"a/masks/left.png\""));
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

TEST_F(RigInspectPictures, SaysWhatTheWrittenFileIs) {
  const std::string mended = folder_.path() + "/mended.yaml";
  const auto applied = [&](const std::string& rig, const std::string& left, const std::string& right) {
    const auto told = inspect(rig, {left, right, "--apply", mended});
    EXPECT_EQ(told.exit_code, 0) << told.err;
    return told.out;
  };
  const std::string rig = folder_.write("rig.yaml", fmt::format(kRig, 0.12));
  EXPECT_THAT(applied(rig, picture(0), picture(1)),
              HasSubstr("\nnothing is to be put right: " + mended + " is the rig as given\n"));
  testing::write_gray_png(folder_.path() + "/gray.png", 320, 240);
  const std::string gray = folder_.path() + "/gray.png";
  EXPECT_THAT(applied(rig, gray, gray), HasSubstr("\nnothing could be judged: " + mended + " is the rig as given\n"));
  EXPECT_THAT(applied("-", gray, gray), HasSubstr("\nnothing could be judged: " + mended + " is the rig as guessed\n"));
  const std::string above = replaced(fmt::format(kRig, 0.5), "[0.5, 0, 0]", "[0, 0.12, 0]");
  EXPECT_THAT(applied(folder_.write("above.yaml", above), picture(0), picture(1)),
              HasSubstr("\nnothing could be judged: "));
  const std::string large = folder_.write("large.yaml", fmt::format(kRig, 4.2));
  EXPECT_THAT(applied(large, picture(0), picture(1)),
              HasSubstr("\nnothing of what was found can be put right: " + mended + " is the rig as given\n"));
  const std::string inverse = folder_.write("inverse.yaml", fmt::format(kRig, -0.12));
  EXPECT_THAT(applied(inverse, picture(0), picture(1)), HasSubstr("\nthe corrected rig: " + mended + "\n"));
}

// A calibration of pictures twice as large, with a mask of that size.
TEST_F(RigInspectPictures, TellsOfMasksOfAnotherSize) {
  std::string text = replaced(fmt::format(kRig, 0.12), "[320, 240]", "[640, 480]");
  text = replaced(replaced(text, "[260, 260]", "[520, 520]"), "[159.5, 119.5]", "[319.5, 239.5]");
  text.replace(text.find("axes: optical"), 0, "self_mask: mask.png, ");
  const std::string rig = folder_.write("rig.yaml", text), mended = folder_.path() + "/mended.yaml";
  const auto said = [&] { return inspect(rig, {picture(0), picture(1), "--apply", mended}).out; };
  const std::string sentence =
      "\ncamera left: its self-mask mask.png is still that of the other size: it must be 320 x 240 px\n";
  testing::write_gray_png(folder_.path() + "/mask.png", 640, 480);
  EXPECT_THAT(said(), HasSubstr(sentence));
  EXPECT_THAT(inspect(rig, {picture(0), picture(1), "--apply", mended, "--json"}).err,
              HasSubstr("camera left: its self-mask mask.png"));
  testing::write_gray_png(folder_.path() + "/mask.png", 320, 240);
  EXPECT_THAT(said(), Not(HasSubstr(sentence)));
}

// Two pairs of a recording with the right camera in common. The rig has the first one's left eye 0.5° too far up; the
// second pair is sound, and both are when that is mended.
TEST_F(RigInspectPictures, MendsPairsThatShareACamera) {
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
  folder_.write("recording/l.png", testing::content_of(picture(0)));
  folder_.write("recording/r.png", testing::content_of(picture(1)));
  const std::string recording = folder_.path() + "/recording", mended = folder_.path() + "/mended.yaml";
  const auto pairs = [&](const std::string& of, std::vector<std::string> more) {
    more.insert(more.end(), {"--recording", recording, "--json"});
    const auto told = inspect(of, std::move(more));
    EXPECT_EQ(told.exit_code, 0) << told.err;
    return json::parse(told.out)["pairs"];
  };
  const json found = pairs(folder_.write("off.yaml", rig(0.5)), {"--apply", mended});
  EXPECT_EQ(ids(found["first"]), std::vector<std::string>{"row_offset"});
  EXPECT_EQ(found["second"]["verdict"], "good");
  const json again = pairs(mended, {});
  EXPECT_EQ(again["first"]["verdict"], "good") << again["first"]["findings"];
  EXPECT_EQ(again["second"]["verdict"], "good") << again["second"]["findings"];
}

// Lines in a pipe, as the other verbs have them; a single shot takes no time worth telling.
TEST_F(RigInspectPictures, ShowsItsProgress) {
  const auto shown = [&](std::vector<std::string> words) {
    return inspect(drive_ + "/calib.txt", std::move(words)).err;
  };
  EXPECT_THAT(shown({"--recording", drive_, "--shots", "3"}),
              ContainsRegex("0/3 shots of pair .*3/3 shots of pair .* matched: judging"));
  EXPECT_EQ(shown({"--recording", drive_, "--shots", "3", "-q"}), "");
  EXPECT_EQ(shown({picture(0), picture(1)}), "");
}

// Three pairs of pictures on top of each other: as taken, rectified as given, corrected. The one of two shots is drawn
// that shows more.
TEST_F(RigInspectPictures, DrawsTheRowsOfBothEyes) {
  std::string text = fmt::format(kRig, 0.12);
  text.replace(text.rfind("axes: optical"), 0, "roll_pitch_yaw_deg: [1, 0, 2], ");
  for (const int eye : {0, 1}) {
    const std::string name = fmt::format("eye_{}/", eye);
    testing::write_gray_png(folder_.file(name + "a.png"), 320, 240);
    folder_.write(name + "b.png", testing::content_of(picture(eye)));
    testing::write_gray_png(folder_.file(name + "c.png"), 320, 240);
  }
  const std::string drawn = folder_.path() + "/rows.png", rig = folder_.write("rig.yaml", text);
  ASSERT_EQ(inspect(rig, {folder_.path() + "/eye_0", folder_.path() + "/eye_1", "--picture", drawn}).exit_code, 0);
  const auto read = read_image(drawn);
  ASSERT_TRUE(read) << read.error().message();
  ASSERT_EQ(read->size(), (ImageSize{640, 3 * (240 + 22)}));
  const auto pixels = read->as<Rgb8>();
  // How far the gray of a strip's eye is from its picture, and how much of it is red: rows 3 px apart.
  const auto compare = [&](int strip, int eye) {
    const auto taken = read_gray8(picture(eye)).value();
    double difference = 0;
    int gray = 0, red = 0;
    for (int y = 0; y < 240; ++y) {
      for (int x = 0; x < 320; ++x) {
        const Rgb8 p = pixels(320 * eye + x, 262 * strip + 22 + y);
        red += p.r > 200 && p.g < 50 ? 1 : 0;
        if (p.r != p.g || p.g != p.b) continue;
        difference += std::abs(p.r - taken(x, y));
        ++gray;
      }
    }
    return std::pair{difference / gray, red};
  };
  EXPECT_GT(compare(1, 0).second, 3000) << "arrows";
  for (const int eye : {0, 1}) {
    EXPECT_LT(compare(0, eye).first, 0.01) << eye;  // rings at wrong matches are gray too
    EXPECT_GT(compare(1, eye).second, 5 * compare(0, eye).second) << eye;
    EXPECT_GT(compare(1, eye).second, 5 * compare(2, eye).second) << eye;
  }
}

TEST_F(RigInspectPictures, NamesPlantedFaultsAndMendsThem) {
  EXPECT_EQ(ids(pair_with_right_eye_at(0.12)), std::vector<std::string>());
  // Two equal eyes do not tell which.
  EXPECT_EQ(ids(pair_with_right_eye_at(-0.12)), (std::vector<std::string>{"inverse_transform", "swapped_eyes"}));
  EXPECT_EQ(ids(pair_with_right_eye_at(120)), std::vector<std::string>{"baseline_unit"});
  const std::string rig = folder_.write("rig.yaml", fmt::format(kRig, -0.12)), mended = folder_.path() + "/mended.yaml";
  const std::string drawn = folder_.path() + "/rows.png";
  ASSERT_EQ(inspect(rig, {picture(0), picture(1), "--apply", mended, "--picture", drawn}).exit_code, 0);
  const auto again = inspect(mended, {picture(0), picture(1), "--json"});
  EXPECT_EQ(json::parse(again.out)["pairs"]["stereo"]["verdict"], "good") << again.out;
  const auto picture_drawn = read_image(drawn);
  ASSERT_TRUE(picture_drawn) << picture_drawn.error().message();
  EXPECT_EQ(picture_drawn->width(), 640);
}

TEST_F(RigInspectPictures, BadInputIsNamed) {
  const std::string rig = drive_ + "/calib.txt";
  EXPECT_EQ(inspect(rig, {picture(0)}).exit_code, 2);
  EXPECT_EQ(inspect("-", {}).exit_code, 2);
  EXPECT_EQ(inspect(rig, {"--apply", folder_.path() + "/x.yaml"}).exit_code, 2);
  EXPECT_EQ(inspect(rig, {picture(0), picture(1), "--pair", "none"}).exit_code, 2);
  EXPECT_EQ(inspect(rig, {picture(0), folder_.path() + "/none.png"}).exit_code, 3);
  EXPECT_EQ(inspect(rig, {drive_ + "/image_0/none*", drive_ + "/image_1"}).exit_code, 3);
  const auto uneven = inspect(rig, {drive_ + "/image_0", picture(1)});
  EXPECT_EQ(uneven.exit_code, 3);
  EXPECT_THAT(uneven.err, HasSubstr("14 left and 1 right"));
  EXPECT_EQ(inspect(rig, {"--recording", folder_.path() + "/none"}).exit_code, 3);
  EXPECT_EQ(inspect(rig, {picture(0), picture(1), "--recording", drive_}).exit_code, 2);
  testing::write_gray_png(folder_.path() + "/small.png", 160, 120);
  const auto odd = inspect(rig, {picture(0), folder_.path() + "/small.png"});
  EXPECT_EQ(odd.exit_code, 3);
  EXPECT_THAT(odd.err, HasSubstr("small.png: is 160 x 120 px"));
  EXPECT_EQ(inspect(rig, {picture(0), picture(1), "--apply", folder_.path() + "/no/such/x.yaml"}).exit_code, 5);
  testing::write_gray_png(folder_.path() + "/gray.png", 320, 240);
  const auto gray = inspect(rig, {folder_.path() + "/gray.png", folder_.path() + "/gray.png", "--json"});
  ASSERT_EQ(gray.exit_code, 0) << gray.err;
  EXPECT_EQ(ids(json::parse(gray.out)["pairs"].front()), std::vector<std::string>{"not_enough_texture"});
}

}  // namespace
}  // namespace spartan
