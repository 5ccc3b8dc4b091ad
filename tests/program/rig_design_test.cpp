// `spartan rig design` from outside.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "program.h"
#include "spartan/image_io/image_io.h"
#include "spartan/testing/real_data.h"
#include "spartan/testing/temporary_folder.h"
#include "spartan/testing/text_checks.h"

namespace spartan {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::replaced;
using testing::run_program;

const std::string& required_rover() {
  static const std::string path = testing::source_folder() + "/config/requirements/rover.yaml";
  return path;
}
std::string rover_text() {
  return testing::content_of(required_rover());
}
std::size_t lines_of(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

// The keys that scripts rely on (docs/reference/json.md).
TEST(RigDesign, JsonHoldsThePublishedFigures) {
  const auto result = run_program({"rig", "design", required_rover(), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json design = json::parse(result.out);
  EXPECT_EQ(design["schema"], 1);
  const json& wide = design["wide"];
  EXPECT_EQ(wide["combinations"], 128960);
  EXPECT_EQ(wide["feasible_count"], 12592);
  EXPECT_EQ(wide["with_pan_overlap_count"], 8876);
  EXPECT_EQ(wide["published"]["feasible"], true);
  EXPECT_NEAR(wide["published"]["range_m"], 4.00, 0.005);
  EXPECT_NEAR(wide["published"]["focal_length_mm"], 6.6, 0.05);
  EXPECT_NEAR(wide["published"]["stereo_angle_deg"], 11.4, 0.05);
  EXPECT_NEAR(wide["published"]["search_percent"], 22.8, 0.05);
  EXPECT_NEAR(wide["published"]["view_near_m"], 0.488, 0.0005);
  EXPECT_NEAR(wide["published"]["view_far_m"], 4.011, 0.0005);
  EXPECT_NEAR(wide["published"]["margins"]["stereo_angle_deg"], 15 - 11.42, 0.005);
  EXPECT_NEAR(wide["published"]["margins"]["search_percent"], 25 - 22.84, 0.005);
  EXPECT_NEAR(wide["published"]["margins"]["pan_overlap_percent"], 5, 1e-9);
  EXPECT_EQ(wide["published"]["is_candidate"], true);
  EXPECT_LT(wide["best"]["pan_overlap_percent"], 25);
  EXPECT_GE(wide["best_with_pan_overlap"]["pan_overlap_percent"], 25);
  const json& narrow = design["narrow"];
  EXPECT_EQ(narrow["published"]["feasible"], false);
  EXPECT_NEAR(narrow["published"]["range_m"], 1.99, 0.005);
  EXPECT_NEAR(narrow["published"]["view_near_m"], 0.200, 0.0005);
  EXPECT_NEAR(narrow["published"]["view_far_m"], 2.516, 0.0005);
  EXPECT_NEAR(design["view_overlap_m"], 2.03, 0.005);
  EXPECT_NEAR(design["pan_overlap_percent"], 30, 1e-9);
  EXPECT_NEAR(design["pan_overlap_far_percent"], 25.6, 0.05);
  EXPECT_NEAR(design["pan_overlap_far_stereo_percent"], 21.6, 0.05);
  EXPECT_NEAR(design["azimuth_far_deg"], 117.1, 0.05);
  EXPECT_NEAR(design["azimuth_far_stereo_deg"], 114.6, 0.05);
  EXPECT_NEAR(design["azimuth_held_from_m"], 0.54, 0.005);
  EXPECT_NEAR(design["azimuth_held_to_m"], 2.05, 0.005);
  ASSERT_EQ(design["azimuth_far_sectors_deg"].size(), 1u);
  EXPECT_NEAR(design["azimuth_far_sectors_deg"][0][1], 117.07 / 2, 0.005);
  EXPECT_NEAR(design["azimuth_far_stereo_sectors_deg"][0][0], -114.65 / 2, 0.005);
  EXPECT_TRUE(design["reasons"].empty());
  EXPECT_GE(design["warnings"].size(), 16u);
  for (const json& warning : design["warnings"]) {
    EXPECT_TRUE(warning["id"].is_string() && warning["text"].is_string() && warning["value"].is_number()) << warning;
    EXPECT_TRUE(warning["text"].get<std::string>().starts_with(warning["pair"].get<std::string>() + ": ")) << warning;
    EXPECT_THAT(warning["pair"], ::testing::AnyOf("wide", "narrow"));
  }
  EXPECT_FALSE(wide.contains("feasible"));
  EXPECT_EQ(run_program({"rig", "design", required_rover(), "--json"}).out, result.out) << "the same in every run";
}

TEST(RigDesign, ListsTheFeasibleSet) {
  const auto some = run_program({"rig", "design", required_rover()});
  ASSERT_EQ(some.exit_code, 0) << some.err;
  EXPECT_THAT(some.out, HasSubstr("12592 of 128960 combinations are feasible"));
  EXPECT_THAT(some.out, HasSubstr("12591 other combinations"));
  EXPECT_THAT(some.out, HasSubstr("12582 more"));
  EXPECT_THAT(some.out, HasSubstr("margins of the best: range +1.521 m"));
  EXPECT_THAT(some.out, HasSubstr("\npair narrow: 1 of 2 combinations are feasible"));
  EXPECT_THAT(some.out, HasSubstr("feasible, one of the combinations): margins: range +0.002 m"));
  EXPECT_THAT(some.out, HasSubstr("not feasible, one of the combinations): margins: range -0.515 m"));
  EXPECT_THAT(some.out, HasSubstr("ground seen by both pairs, middle column: 2.03 m\n"));
  EXPECT_THAT(some.out, HasSubstr("at the far edge: 117.1 deg (one camera), 114.6 deg (both)\n"));
  EXPECT_LT(lines_of(some.out), 70u);
  EXPECT_THAT(run_program({"rig", "design", required_rover(), "--rows", "3"}).out, HasSubstr("...  12589 more;"));
  const auto all = run_program({"rig", "design", required_rover(), "--all"});
  EXPECT_EQ(all.exit_code, 0);
  EXPECT_GT(lines_of(all.out), 12592u);
  EXPECT_THAT(all.out, HasSubstr(" 12592.  "));
  EXPECT_THAT(all.out, Not(HasSubstr(" more;")));
  const auto result = run_program({"rig", "design", required_rover(), "--all", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json whole = json::parse(result.out);
  ASSERT_EQ(whole["wide"]["feasible"].size(), 12592u);
  EXPECT_EQ(whole["wide"]["feasible"][0], whole["wide"]["best"]);
  const auto published =
      std::find_if(whole["wide"]["feasible"].begin(), whole["wide"]["feasible"].end(), [](const json& pair) {
        return pair["baseline_m"] == 0.2 && pair["nearest_m"] == 1.0 && pair["hfov_deg"] == 50.0 &&
               pair["pixel_size_um"] == 5.5 && pair["width_px"] == 1120;
      });
  ASSERT_NE(published, whole["wide"]["feasible"].end());
  EXPECT_NEAR((*published)["focal_length_mm"], 6.6, 0.05);
  // Nothing but the sets comes with --all, and the text is laid out like that of any other JSON.
  nlohmann::ordered_json without = nlohmann::ordered_json::parse(result.out);
  EXPECT_TRUE(without.dump(2) + "\n" == result.out);  // too long to be shown side by side
  for (const char* pair : {"wide", "narrow"}) without[pair].erase("feasible");
  EXPECT_EQ(without.dump(2) + "\n", run_program({"rig", "design", required_rover(), "--json"}).out);
}

TEST(RigDesign, DrawsTheGround) {
  const testing::TemporaryFolder folder;
  const std::string out = folder.path() + "/deep/design";
  ASSERT_EQ(run_program({"rig", "design", required_rover(), "-o", out, "-q"}).exit_code, 0);
  const std::string csv = testing::content_of(out + "/feasible.csv");
  EXPECT_EQ(lines_of(csv), 1u + 12592 + 1);
  EXPECT_THAT(csv, HasSubstr("enough_pan_overlap,tilt_deg,view_near_m,view_far_m\nwide,1,"));
  EXPECT_THAT(csv, HasSubstr("\nwide,12592,"));
  EXPECT_THAT(csv, ::testing::EndsWith(",,0,32.8,0.18191,2.50422\n")) << "no pans, tilt, near and far edge";
  const std::string svg = testing::content_of(out + "/ground.svg");
  EXPECT_THAT(svg, ::testing::StartsWith("<svg"));
  EXPECT_THAT(svg, ::testing::EndsWith("</svg>\n"));
  for (const char* label :
       {"wide: 0.488 to 4.011 m", "narrow: 0.200 to 2.516 m", "both: 2.03 m", "far edge, one camera: 117.1°",
        "far edge, both cameras: 114.6°", "required: 120°", "pan -35°", "pan 0°", "pan 35°", "blind: up to 0.200 m",
        "by 25.6 % (one camera) and 21.6 % (both cameras)"}) {
    EXPECT_THAT(svg, HasSubstr(label));
  }
  const auto png = read_image(out + "/ground.png");
  ASSERT_TRUE(png) << png.error().message();
  EXPECT_EQ(png->size().width, 1200);
  EXPECT_THAT(svg, HasSubstr("height=\"" + std::to_string(png->size().height) + "\""));
}

using Corners = std::vector<std::pair<double, double>>;

// The areas of that colour and opacity.
std::vector<Corners> areas_of(const std::string& svg, const std::string& fill, const std::string& opacity) {
  const std::regex area("<polygon points=\"([^\"]*)\" fill=\"" + fill + "\" fill-opacity=\"" + opacity + "\"/>");
  std::vector<Corners> areas;
  for (std::sregex_iterator found(svg.begin(), svg.end(), area), end; found != end; ++found) {
    std::istringstream numbers((*found)[1]);
    Corners corners;
    double x = 0, y = 0;
    char comma = 0;
    while (numbers >> x >> comma >> y) corners.emplace_back(x, y);
    areas.push_back(corners);
  }
  return areas;
}
double wide_px(const Corners& bar) {
  return bar.at(1).first - bar.at(0).first;
}
// Where the words stand.
double x_of(const std::string& svg, const std::string& words) {
  const std::size_t end = svg.find(">" + words + "<");
  return end == std::string::npos ? NAN : std::stod(svg.substr(svg.rfind("x=\"", end) + 3));
}

// Left is left, lengths are to scale, and every kind of ground has its colour.
TEST(RigDesign, TheGroundIsDrawnToScale) {
  const testing::TemporaryFolder folder;
  const std::string required = folder.write("required.yaml", replaced(rover_text(), "name: ", "name: a<b "));
  ASSERT_EQ(run_program({"rig", "design", required, "-o", folder.path(), "--force", "-q"}).exit_code, 0);
  const std::string svg = testing::content_of(folder.path() + "/ground.svg");
  EXPECT_THAT(svg, HasSubstr("a&lt;b"));
  EXPECT_LT(x_of(svg, "pan 35°"), x_of(svg, "pan 0°"));
  EXPECT_LT(x_of(svg, "pan 0°"), x_of(svg, "pan -35°"));
  // The narrow pair's bar: 2 cm hold from 0.200 to 1.985 m, from there on to 2.516 m they do not.
  const auto held = areas_of(svg, "#d55e00", "0.9"), beyond = areas_of(svg, "#d55e00", "0.3");
  ASSERT_EQ(held.size(), 1u);
  ASSERT_EQ(beyond.size(), 1u);
  EXPECT_NEAR(wide_px(held[0]) / wide_px(beyond[0]), (1.985 - 0.200) / (2.516 - 1.985), 0.02);
  // It looks ahead: its ground lies alike on both sides of the rover. The legend has its colour too.
  const auto narrow = areas_of(svg, "#d55e00", "0.45");
  ASSERT_EQ(narrow.size(), 2u);
  double sum = 0;
  for (const auto& [x, y] : narrow[0]) sum += x - 600;
  EXPECT_NEAR(sum, 0, 0.1);
  EXPECT_EQ(areas_of(svg, "#c8e2f3", "1").size(), 6u + 1) << "one camera, at three pans";
  EXPECT_EQ(areas_of(svg, "#86bbde", "1").size(), 3u + 1) << "both cameras";
  EXPECT_EQ(areas_of(svg, "#3a86bc", "1").size(), 3u + 1) << "two pans, whichever";
  EXPECT_EQ(areas_of(svg, "#dedede", "1").size(), 1u + 1) << "required, not seen";
  EXPECT_EQ(areas_of(svg, "#969696", "0.9").size(), 1u) << "blind";
}

// The pixels show what the SVG says: words in the title's line, the colours of both pairs.
TEST(RigDesign, ThePixelsAreThoseOfTheDrawing) {
  const testing::TemporaryFolder folder;
  ASSERT_EQ(run_program({"rig", "design", required_rover(), "-o", folder.path(), "--force", "-q"}).exit_code, 0);
  const auto read = read_image(folder.path() + "/ground.png");
  ASSERT_TRUE(read) << read.error().message();
  const auto pixels = read->as<Rgb8>();
  const auto count = [&](Rgb8 colour, int rows) {
    int found = 0;
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < pixels.width(); ++x) found += pixels(x, y) == colour ? 1 : 0;
    }
    return found;
  };
  EXPECT_GT(count({30, 30, 30}, 60), 100) << "the title";
  EXPECT_GT(count({134, 187, 222}, pixels.height()), 10000) << "seen by both cameras of the wide pair";
  EXPECT_GT(count({222, 222, 222}, pixels.height()), 1000) << "required, not seen";
}

// Pairs of other kinds are drawn too: no pans, no narrow pair, nothing published, many pans, high masts.
TEST(RigDesign, DrawsWhatIsAskedOfOthers) {
  const testing::TemporaryFolder folder;
  const std::string text = rover_text();
  const std::string wide_only = text.substr(0, text.find("# At the mast's foot"));
  const std::string unpublished = wide_only.substr(0, wide_only.find("  published:"));
  const std::string without_pans =
      replaced(unpublished,
               "  pans:\n    angles_deg: [-35, 0, 35]\n    azimuth_deg: 120\n    smallest_overlap_percent: 25\n", "");
  const std::string all_round = replaced(unpublished, "[-35, 0, 35]\n    azimuth_deg: 120",
                                         "{from: -180, to: 150, step: 30}\n    azimuth_deg: 360");
  for (const std::string& required :
       {wide_only, unpublished, without_pans, all_round,
        replaced(replaced(unpublished, "  height_m: 1.0", "  height_m: 30"), "range_m: 4", "range_m: 3")}) {
    const auto result = run_program(
        {"rig", "design", folder.write("required.yaml", required), "-o", folder.path() + "/out", "--force"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(read_image(folder.path() + "/out/ground.png"));
    EXPECT_THAT(testing::content_of(folder.path() + "/out/ground.svg"), Not(HasSubstr("nan")));
  }
  const auto off = run_program(
      {"rig", "design", folder.write("off.yaml", replaced(wide_only, "hfov_deg: 50", "hfov_deg: 50.5")), "--json"});
  EXPECT_EQ(json::parse(off.out)["wide"]["published"]["is_candidate"], false) << off.out;
  // Nothing to draw is a warning, not an error.
  const auto none =
      run_program({"rig", "design", folder.write("none.yaml", replaced(unpublished, "range_m: 4.0", "range_m: 12")),
                   "-o", folder.path() + "/none"});
  EXPECT_EQ(none.exit_code, 0);
  EXPECT_THAT(none.out, HasSubstr("none of the 128960 combinations is feasible"));
  EXPECT_THAT(none.err, HasSubstr("no figure is written"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() + "/none/ground.svg"));
  EXPECT_EQ(json::parse(run_program({"rig", "design", folder.path() + "/none.yaml", "--json"}).out)["wide"]["best"],
            nullptr);
}

// The text of a ground figure.
std::string drawn(const testing::TemporaryFolder& folder, const std::string& required) {
  const auto result =
      run_program({"rig", "design", folder.write("required.yaml", required), "-o", folder.path() + "/out", "--force"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, Not(HasSubstr("nan")));
  std::string svg = testing::content_of(folder.path() + "/out/ground.svg");
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
  return svg;
}

TEST(RigDesign, DrawsWhatPansWithGapsOrToOneSideSee) {
  const testing::TemporaryFolder folder;
  const auto required = [](const std::string& angles, int azimuth_deg) {
    return replaced(replaced(rover_text(), "[-35, 0, 35]", angles), "azimuth_deg: 120",
                    "azimuth_deg: " + std::to_string(azimuth_deg));
  };
  struct {
    std::string angles;
    int azimuth_deg;
    std::vector<std::string> words;
  } const cases[] = {
      {"[-80, 0, 80]", 120, {"far edge, one camera: 54.1°", "all 120° at no distance", "leave a gap of 30.0°"}},
      {"[0, 35, 70]", 120, {"far edge, both cameras: 82.3°", "all 120° at no distance", "by 25.6 % (one camera)"}},
      {"[-60, -35, 35]", 120, {"far edge, one camera: 95.6°", "all 120°: 0.60 to 0.70 m", "leave a gap of 20.0°"}},
      {"[-35, 0, 35]", 10, {"required: 10°", "far edge, one camera: 10.0°", "all 10°: 0.49 to 4.01 m"}},
      {"[-180, -90, 0, 90, 180]", 360, {"far edge, one camera: 188.3°", "all 360° at no distance"}},
      {"{from: -180, to: 150, step: 30}", 360, {"far edge, both cameras: 360.0°", "all 360°: 0.50 to 4.01 m"}}};
  for (const auto& c : cases) {
    const std::string svg = drawn(folder, required(c.angles, c.azimuth_deg));
    for (const std::string& words : c.words) EXPECT_THAT(svg, HasSubstr(words)) << c.angles;
  }
}

TEST(RigDesign, CamerasWithoutCommonGroundGiveNoNan) {
  const testing::TemporaryFolder folder;
  const std::string apart = replaced(rover_text(), "    baseline_m: 0.20", "    baseline_m: 20");
  EXPECT_THAT(drawn(folder, apart), HasSubstr("both cameras share no ground"));
  const json design = json::parse(run_program({"rig", "design", folder.path() + "/required.yaml", "--json"}).out);
  EXPECT_EQ(design["azimuth_far_stereo_deg"], 0);
  EXPECT_EQ(design["pan_overlap_far_stereo_percent"], nullptr);
  EXPECT_THAT(design["reasons"]["pan_overlap_far_stereo_percent"], "the two cameras share no ground");
  EXPECT_EQ(design["reasons"].size(), 1u);
  for (const json& warning : design["warnings"]) EXPECT_TRUE(warning["value"].is_number()) << warning;
}

TEST(RigDesign, BadInputIsNamed) {
  const testing::TemporaryFolder folder;
  EXPECT_EQ(run_program({"rig", "design"}).exit_code, 2);
  EXPECT_EQ(run_program({"rig", "design", required_rover(), "--rows", "-3"}).exit_code, 2);
  const auto missing = run_program({"rig", "design", folder.path() + "/none.yaml"});
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_THAT(missing.err, HasSubstr("none.yaml"));
  const std::string wrong =
      replaced(replaced(rover_text(), "range_m: 4.0", "range_m: far"), "widths_px: [780,", "widths_px: [-780,");
  const auto refused =
      run_program({"rig", "design", folder.write("wrong.yaml", wrong), "-o", folder.path() + "/out", "--json"});
  EXPECT_EQ(refused.exit_code, 4);
  EXPECT_THAT(refused.out, HasSubstr("\"exit_code\": 4"));
  EXPECT_THAT(refused.err, HasSubstr("wide.range_m: 'far' is not a number"));
  EXPECT_THAT(refused.err, HasSubstr("wide.candidates.widths_px: holds -780"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() + "/out"));
}

TEST(RigDesign, AnOutputThatCannotBeWrittenIsSaid) {
  const testing::TemporaryFolder folder;
  const std::string in_the_way = folder.write("file", "");
  EXPECT_EQ(run_program({"rig", "design", required_rover(), "-o", in_the_way}).exit_code, 5);
  testing::ProgramLimits disk;
  disk.largest_file_bytes = 4096;
  const auto full = run_program({"rig", "design", required_rover(), "-o", folder.path() + "/full"}, disk);
  EXPECT_EQ(full.exit_code, 5) << full.err;
  EXPECT_FALSE(std::filesystem::exists(folder.path() + "/full/feasible.csv"));
}

}  // namespace
}  // namespace spartan
