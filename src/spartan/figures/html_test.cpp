#include "spartan/figures/html.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace spartan {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Html, TextIsEscaped) {
  EXPECT_EQ(html_text("a < b & \"c\" > d"), "a &lt; b &amp; &quot;c&quot; &gt; d");
}

TEST(Html, TablesEscapeTheirCellsAndBeginWithAHeader) {
  const std::string table = html_table("states & more", {{"sensor", "state"}, {"imu", "<script>"}});
  EXPECT_THAT(table, HasSubstr("<th scope=\"col\">sensor</th><th scope=\"col\">state</th>"));
  EXPECT_THAT(table, HasSubstr("<th scope=\"row\">imu</th><td>&lt;script&gt;</td>"));
  EXPECT_THAT(table, HasSubstr("<caption>states &amp; more</caption>"));
  EXPECT_THAT(table, Not(HasSubstr("<script>")));
}

TEST(Html, ImagesAreEmbeddedWithTheirSizeAndCaption) {
  Image<std::uint8_t> image(3, 2);
  image.fill(7);
  const std::string figure = html_image(image.view(), "a < b", "<i>below</i>");
  EXPECT_THAT(figure, HasSubstr("alt=\"a &lt; b\" width=\"3\" height=\"2\" src=\"data:image/png;base64,iVBORw0KGgo"));
  EXPECT_THAT(figure, HasSubstr("<i>below</i>"));
}

// The closed form of a block mean; the border that fills no block is cut off.
TEST(Html, ShrinkingAveragesBlocks) {
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

}  // namespace
}  // namespace spartan
