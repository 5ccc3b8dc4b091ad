#include "spartan/report/internal/html_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <string>

namespace spartan::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(HtmlParts, TextIsEscaped) {
  EXPECT_EQ(html_text("a < b & \"c\" > d"), "a &lt; b &amp; &quot;c&quot; &gt; d");
}

TEST(HtmlParts, TablesEscapeTheirCellsAndBeginWithAHeader) {
  const std::string table = html_table({{"sensor", "state"}, {"imu", "<script>"}});
  EXPECT_THAT(table, HasSubstr("<th>sensor</th><th>state</th>"));
  EXPECT_THAT(table, HasSubstr("<td>imu</td><td>&lt;script&gt;</td>"));
  EXPECT_THAT(table, Not(HasSubstr("<script>")));
}

TEST(HtmlParts, APageLoadsNothingFromOutside) {
  Image<std::uint8_t> image(3, 2);
  image.fill(7);
  const std::string page = html_page("a & b", html_image(image.view(), "caption", 30));
  EXPECT_THAT(page, HasSubstr("<title>a &amp; b</title>"));
  EXPECT_THAT(page, HasSubstr("src=\"data:image/png;base64,iVBORw0KGgo"));
  EXPECT_FALSE(std::regex_search(page, std::regex("(src|href)=\"(?!data:)")));
}

// The closed form of a block mean; the border that fills no block is cut off.
TEST(HtmlParts, ShrinkingAveragesBlocks) {
  Image<std::uint8_t> gray(5, 4);
  Image<Rgb8> colour(5, 4);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 5; ++x) {
      const int level = 10 * x + y;
      gray(x, y) = static_cast<std::uint8_t>(level);
      colour(x, y) = {static_cast<std::uint8_t>(level), static_cast<std::uint8_t>(level + 1),
                      static_cast<std::uint8_t>(level + 2)};
    }
  }
  const auto small = shrunk(gray.view(), 3);
  ASSERT_EQ(small.view().size(), (ImageSize{2, 2}));
  EXPECT_EQ(small(0, 0), (0 + 10 + 1 + 11) / 4);
  EXPECT_EQ(small(1, 1), (22 + 32 + 23 + 33) / 4);
  const auto small_colour = shrunk(colour.view(), 3);
  EXPECT_EQ(small_colour(1, 1), (Rgb8{27, 28, 29}));
  EXPECT_EQ(shrunk(gray.view(), 100).view().size(), gray.view().size()) << "never enlarged";
}

TEST(HtmlParts, DivergingColoursAreBlueWhiteRed) {
  const Rgb8 low = cold_to_hot(-1), middle = cold_to_hot(0.5), high = cold_to_hot(2);
  EXPECT_GT(low.b, low.r + 50);
  EXPECT_GT(high.r, high.b + 50);
  EXPECT_GT(std::min({middle.r, middle.g, middle.b}), 250);
}

// The first and the last point of a line, in pixels of the plot.
std::vector<double> ends_of_polyline(const std::string& svg) {
  std::smatch found;
  EXPECT_TRUE(
      std::regex_search(svg, found, std::regex("points=\"([-0-9.]+),([-0-9.]+) (.*? )?([-0-9.]+),([-0-9.]+) \"")));
  return {std::stod(found[1]), std::stod(found[2]), std::stod(found[4]), std::stod(found[5])};
}

TEST(HtmlParts, PlotsGrowToTheRightAndUpwards) {
  const auto ends = ends_of_polyline(svg_plot({{"rise", "#000", {0, 1, 2}, {0, 5, 10}}}, {"x", "y"}));
  EXPECT_LT(ends[0], ends[2]);
  EXPECT_GT(ends[1], ends[3]) << "rows of an SVG count downwards";
}

TEST(HtmlParts, EqualAxesHaveOneScale) {
  PlotOptions options;
  options.equal_axes = true;
  const auto ends = ends_of_polyline(svg_plot({{"line", "#000", {0, 30}, {0, 10}}}, options));
  EXPECT_NEAR((ends[2] - ends[0]) / 30, (ends[1] - ends[3]) / 10, 0.02);
}

TEST(HtmlParts, APlotWithoutPointsIsStillAPlot) {
  const std::string svg = svg_plot({}, {"time, s", "error & bound, m"});
  EXPECT_THAT(svg, HasSubstr("<svg"));
  EXPECT_THAT(svg, HasSubstr("error &amp; bound, m"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

}  // namespace
}  // namespace spartan::internal
