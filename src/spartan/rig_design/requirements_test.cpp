#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <filesystem>
#include <fstream>

#include "spartan/rig_design/rig_designer.h"
#include "spartan/testing/doc_example.h"
#include "spartan/testing/temporary_folder.h"
#include "spartan/testing/text_checks.h"

namespace spartan {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::replaced;

const std::string kGood = R"(schema: 1
wide:
  range_m: 4
  range_resolution_m: 0.02
  disparity_accuracy_px: 0.3
  largest_stereo_angle_deg: 15
  largest_search_percent: 25
  height_m: 1
  tilt_step_deg: 1
  candidates:
    widths_px: [780, 1120]
    pixel_sizes_um: [5.5]
    baselines_m: {from: 0.05, to: 0.30, step: 0.01}
    nearest_m: {from: 0.6, to: 1.5, step: 0.1}
    hfov_deg: [50]
  order: [range_margin]
)";

std::string error_message(const std::string& what, const std::string& with) {
  return testing::error_message(parse_requirements(replaced(kGood, what, with), "my.yaml"));
}

TEST(Requirements, ReadsAMinimalFile) {
  const auto read = parse_requirements(kGood, "some/my.yaml");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->name, "my");
  EXPECT_FALSE(read->pairs.size() > 1);
  EXPECT_FALSE(read->pairs[0].pans);
  EXPECT_FALSE(read->pairs[0].published);
  EXPECT_EQ(read->pairs[0].smallest_baseline_m, 0);
  EXPECT_EQ(read->pairs[0].rows_per_column, 1);
  EXPECT_EQ(read->pairs[0].lists.combinations(), 2u * 1 * 26 * 10 * 1);
}

// Equal to the decimals as typed, whatever the rounding of the steps.
TEST(Requirements, StepsAreExactDecimals) {
  const auto read = parse_requirements(kGood, "my.yaml");
  ASSERT_TRUE(read);
  const CandidateLists& lists = read->pairs[0].lists;
  ASSERT_EQ(lists.baselines_m.size(), 26u);
  for (int i = 0; i < 26; ++i) EXPECT_EQ(lists.baselines_m[static_cast<std::size_t>(i)], (5 + i) / 100.0);
  EXPECT_THAT(lists.nearest_m, ElementsAre(0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5));
}

TEST(Requirements, PansMayBeInAnyOrder) {
  const auto read = parse_requirements(
      kGood + "  pans: {angles_deg: [10, -50, 0], azimuth_deg: 90, smallest_overlap_percent: 5}\n", "my.yaml");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_THAT(read->pairs[0].pans->angles_deg, ElementsAre(-50, 0, 10));
  EXPECT_EQ(read->pairs[0].pans->widest_step_deg(), 50);
}

TEST(Requirements, RowsOfThePublishedPair) {
  const std::string published =
      "  rows_per_column: 0.5\n"
      "  published: {baseline_m: 0.2, nearest_m: 1, hfov_deg: 50, pixel_size_um: 5.5, width_px: 1000}\n";
  const auto rows = [](const std::string& text) {
    return parse_requirements(text, "my.yaml").value().pairs[0].published_rows_per_column();
  };
  EXPECT_EQ(rows(kGood + published), 0.5);
  EXPECT_EQ(rows(kGood + replaced(published, "width_px: 1000", "width_px: 1000, height_px: 800")), 0.8);
}

TEST(Requirements, ShippedFilesHoldThePublishedLists) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(testing::source_folder() + "/config/requirements")) {
    const auto read = read_requirements(entry.path().string());
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_EQ(read->name, entry.path().stem().string());
    ++count;
  }
  EXPECT_GE(count, 1);
  const auto rover = read_requirements(testing::source_folder() + "/config/requirements/rover.yaml").value();
  EXPECT_EQ(rover.pairs[0].lists.combinations(), 26u * 10 * 31 * 4 * 4);
  EXPECT_THAT(rover.pairs[0].lists.widths_px, ElementsAre(780, 1040, 1120, 1280));
  EXPECT_THAT(rover.pairs[0].lists.pixel_sizes_um, ElementsAre(4.54, 5.5, 7.4, 9));
  EXPECT_EQ(rover.pairs[0].lists.baselines_m.front(), 0.05);
  EXPECT_EQ(rover.pairs[0].lists.baselines_m.back(), 0.30);
  EXPECT_EQ(rover.pairs[0].lists.hfov_deg.front(), 40);
  EXPECT_EQ(rover.pairs[0].lists.hfov_deg.back(), 70);
  EXPECT_EQ(rover.pairs[0].smallest_baseline_m, 0.1);
  EXPECT_EQ(rover.pairs[0].smallest_height_m, 1);
  EXPECT_THAT(rover.pairs[0].order, ElementsAre(DesignCriterion::range_margin, DesignCriterion::pan_overlap,
                                                DesignCriterion::shorter_baseline));
  EXPECT_EQ(rover.pairs[0].pans->widest_step_deg(), 35);
}

TEST(Requirements, EachErrorIsReportedWithItsLine) {
  EXPECT_THAT(error_message("range_m: 4", "range_m: nan"), HasSubstr("my.yaml:3: wide.range_m: is nan"));
  EXPECT_THAT(error_message("range_m: 4", "range_m: -4"), HasSubstr("my.yaml:3: wide.range_m: is -4"));
  EXPECT_THAT(error_message("  range_m: 4\n", ""), HasSubstr("wide.range_m: is missing"));
  EXPECT_THAT(error_message("schema: 1", "schema: 2"), HasSubstr("reads schema 1"));
  EXPECT_THAT(error_message("[780, 1120]", "[780, 780]"),
              HasSubstr("my.yaml:11: wide.candidates.widths_px: holds 780 twice"));
  EXPECT_THAT(error_message("[780, 1120]", "[780.5]"), HasSubstr("whole numbers"));
  EXPECT_THAT(error_message("[780, 1120]", "[]"), HasSubstr("must have 1 to"));
  EXPECT_THAT(error_message("[780, 1120]", "7"), HasSubstr("{from, to, step}"));
  EXPECT_THAT(error_message("[5.5]", "[wide]"), HasSubstr("numbers only"));
  EXPECT_THAT(error_message("to: 0.30, step: 0.01", "to: 0.305, step: 0.01"),
              HasSubstr("does not divide the range from 0.05 to 0.305 evenly"));
  EXPECT_THAT(error_message("to: 0.30, step: 0.01", "to: 0.30, step: 0"), HasSubstr("must be positive"));
  EXPECT_THAT(error_message("to: 0.30, step: 0.01", "to: 0.01, step: 0.01"), HasSubstr("below from"));
  EXPECT_THAT(error_message("to: 0.30, step: 0.01", "to: 0.30, step: 1e-9"), HasSubstr("more than 1000 values"));
  EXPECT_THAT(error_message("hfov_deg: [50]", "hfov_deg: [190]"), HasSubstr("between 0.1 and 179"));
  EXPECT_THAT(error_message("[range_margin]", "[cheapest]"), HasSubstr("wide.order"));
  EXPECT_THAT(error_message("[range_margin]", "[range_margin, range_margin]"), HasSubstr("twice"));
  EXPECT_THAT(error_message("height_m: 1", "height_m: 1\n  smallest_height_m: 1.5"),
              HasSubstr("below smallest_height_m, 1.5"));
  EXPECT_THAT(error_message("tilt_step_deg: 1", "tilt_step_deg: 15"), HasSubstr("14.036 degrees below the horizon"));
  EXPECT_THAT(error_message("  order",
                            "  pans: {angles_deg: [0, 400], azimuth_deg: 90, smallest_overlap_percent: 25}\n  order"),
              HasSubstr("wide.pans.angles_deg: holds 400"));
  EXPECT_THAT(
      error_message("  order",
                    "  published: {baseline_m: 0.2, nearest_m: 1, hfov_deg: 50, pixel_size_um: 5.5, width_px: 1120, "
                    "tilt_deg: 20}\n  order"),
      HasSubstr("wide.published.tilt_deg: is 20, so the top row, 25.00 degrees higher, would be above the horizon"));
  EXPECT_THAT(error_message("  order", "  nonsense: 1\n  order"), HasSubstr("wide.nonsense: unknown key"));
  EXPECT_THAT(error_message("wide:", "wide: 3\nmore:"), HasSubstr("wide: must be a group"));
}

TEST(Requirements, AllErrorsAreReportedAtOnce) {
  const auto read = parse_requirements(
      replaced(replaced(replaced(kGood, "range_m: 4", "range_m: 0"), "[780, 1120]", "[0]"), "[5.5]", "[5.5, .inf]"),
      "my.yaml");
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message(), HasSubstr("my.yaml:3: "));
  EXPECT_THAT(read.error().message(), HasSubstr("my.yaml:11: "));
  EXPECT_THAT(read.error().message(), HasSubstr("my.yaml:12: "));
}

TEST(Requirements, TooManyCombinationsAreRejected) {
  std::string text = replaced(kGood, "[50]", "{from: 40, to: 70, step: 0.1}");
  text = replaced(text, "step: 0.01", "step: 0.001");
  text = replaced(text, "step: 0.1}\n    hfov", "step: 0.01}\n    hfov");
  const auto read = parse_requirements(text, "my.yaml");
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message(), HasSubstr("my.yaml:10: wide.candidates: has 13750282 combinations"));
}

TEST(Requirements, PairsHaveFreeNamesAndDefaults) {
  const std::string text =
      "schema: 1\npairs:\n  mast: {range_m: 4, height_m: 1}\n  hazard: {range_m: 2, height_m: 0.3}\n";
  const auto read = parse_requirements(text, "my.yaml");
  ASSERT_TRUE(read) << read.error().message();
  ASSERT_EQ(read->pairs.size(), 2u);
  EXPECT_EQ(read->pairs[0].name, "mast");
  EXPECT_EQ(read->pairs[1].name, "hazard");
  EXPECT_EQ(read->pairs[0].range_resolution_m, 0.02);
  EXPECT_EQ(read->pairs[1].disparity_accuracy_px, 0.3);
  EXPECT_EQ(read->pairs[1].largest_stereo_angle_deg, 15);
  EXPECT_THAT(read->pairs[0].lists.widths_px, ElementsAre(640, 1024, 1280, 1920));
  EXPECT_EQ(read->pairs[0].lists.baselines_m.size(), 10u);
  EXPECT_EQ(read->pairs[0].order.size(), 3u);
  EXPECT_EQ(read->panned(), 0u) << "without pans the first pair";
  const auto panned =
      parse_requirements(text.substr(0, text.rfind('}')) + ", pans: {angles_deg: [0], azimuth_deg: 40}}\n", "my.yaml");
  ASSERT_TRUE(panned) << panned.error().message();
  EXPECT_EQ(panned->panned(), 1u);
}

TEST(Requirements, PairsNeedNamesOfTheirOwn) {
  const auto message = [](const std::string& pairs) {
    return testing::error_message(parse_requirements("schema: 1\n" + pairs, "my.yaml"));
  };
  const std::string pair = "{range_m: 4, height_m: 1}\n";
  EXPECT_THAT(message(""), HasSubstr("pairs: is missing"));
  EXPECT_THAT(message("pairs: {}\n"), HasSubstr("pairs: is missing"));
  EXPECT_THAT(message("pairs: 3\n"), HasSubstr("must be a group"));
  EXPECT_THAT(message("pairs:\n  mast: 3\n"), HasSubstr("my.yaml:3: pairs.mast: must be a group"));
  EXPECT_THAT(message("pairs:\n  warnings: " + pair), HasSubstr("my.yaml:3: pairs.warnings: cannot be the name"));
  EXPECT_THAT(message("pairs:\n  wide: " + pair + "wide: " + pair), HasSubstr("pairs.wide: is given twice"));
  EXPECT_THAT(message("pairs:\n  mast: {range_m: 4}\n"), HasSubstr("my.yaml:3: pairs.mast.height_m: is missing"));
}

TEST(Requirements, MissingFileIsAnInputError) {
  const testing::TemporaryFolder folder;
  EXPECT_EQ(read_requirements(folder.path() + "/none.yaml").error().code, ErrorCode::input);
  EXPECT_EQ(read_requirements(folder.path()).error().code, ErrorCode::input);
}

// The example in the documentation has every key that the reader knows, and the table below it explains each.
TEST(Requirements, DocumentationNamesEveryKey) {
  const std::string text = testing::doc_example("requirements.yaml");
  ASSERT_FALSE(text.empty());
  const auto read = parse_requirements(text, "docs/reference/requirements.md");
  ASSERT_TRUE(read) << read.error().message();
  const std::string page = testing::reference_page("requirements");
  const std::string table = page.substr(page.find("| key", page.find("requirements.yaml -->")));
  const std::string known = error_message("  order", "  nonsense: 1\n  order") +
                            error_message("    nearest_m", "    nonsense: 1\n    nearest_m") +
                            error_message("  order", "  pans: {nonsense: 1}\n  order") +
                            error_message("  order", "  published: {nonsense: 1}\n  order");
  for (const char* key : {"range_m",
                          "range_resolution_m",
                          "disparity_accuracy_px",
                          "largest_stereo_angle_deg",
                          "contradicting_stereo_angle_deg",
                          "largest_search_percent",
                          "smallest_baseline_m",
                          "smallest_height_m",
                          "height_m",
                          "tilt_step_deg",
                          "rows_per_column",
                          "candidates",
                          "widths_px",
                          "pixel_sizes_um",
                          "baselines_m",
                          "nearest_m",
                          "hfov_deg",
                          "order",
                          "pans",
                          "angles_deg",
                          "azimuth_deg",
                          "smallest_overlap_percent",
                          "published",
                          "baseline_m",
                          "pixel_size_um",
                          "width_px",
                          "height_px",
                          "vfov_deg",
                          "focal_length_mm",
                          "tilt_deg"}) {
    EXPECT_THAT(known, HasSubstr(key));
    EXPECT_NE(text.find(key), std::string::npos) << key << " in the example";
    EXPECT_NE(table.find(std::string(key) + "`"), std::string::npos) << key << " in the table";
  }
}

// A truncated file, or one with a changed byte, is read or rejected without a crash.
RC_GTEST_PROP(Requirements, DamagedFilesDoNotCrash, ()) {
  std::string text = kGood;
  if (*rc::gen::arbitrary<bool>()) {
    text.resize(*rc::gen::inRange<std::size_t>(0, text.size()));
  } else {
    text[*rc::gen::inRange<std::size_t>(0, text.size())] = static_cast<char>(*rc::gen::inRange(0, 256));
  }
  const auto read = parse_requirements(text, "my.yaml");
  if (!read) RC_ASSERT(read.error().code == ErrorCode::configuration);
  if (read && read->pairs[0].lists.combinations() < 10000) {
    const RigDesign design = design_rig(*read);
    RC_ASSERT(design.pairs[0].feasible.size() <= design.pairs[0].combinations);
  }
}

}  // namespace
}  // namespace spartan
