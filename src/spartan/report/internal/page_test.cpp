#include "spartan/report/internal/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <string>
#include <vector>

#include "spartan/figures/html.h"
#include "spartan/report/internal/page_parts.h"

namespace spartan::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Page, LoadsNothingFromOutside) {
  const std::string page =
      html_page("a & b", "", {{"Images", html_image(Image<std::uint8_t>(3, 2).view(), "caption")}});
  EXPECT_THAT(page, HasSubstr("<title>a &amp; b</title>"));
  EXPECT_FALSE(std::regex_search(page, std::regex("src=\"(?!data:)|<link [^>]*href=\"(?!data:)|url\\(")));
}

TEST(PageParts, IndicesAreSpreadFromTheFirstToTheLast) {
  using Indices = std::vector<std::size_t>;
  EXPECT_EQ(spread_indices(0, 3), Indices());
  EXPECT_EQ(spread_indices(1, 3), Indices{0});
  EXPECT_EQ(spread_indices(2, 3), (Indices{0, 1}));
  EXPECT_EQ(spread_indices(101, 3), (Indices{0, 50, 100}));
  EXPECT_EQ(spread_indices(9, 1), Indices{0});
}

TEST(Page, ListsItsSectionsAndLeavesEmptyOnesOut) {
  const std::string page = html_page("t", "<p>head</p>", {{"Time and memory", "<p>1 s</p>"}, {"Maps", ""}});
  EXPECT_THAT(page, HasSubstr("<a href=\"#time-and-memory\">Time and memory</a>"));
  EXPECT_THAT(page, HasSubstr("<h2 id=\"time-and-memory\">"));
  EXPECT_THAT(page, Not(HasSubstr("Maps")));
}

}  // namespace
}  // namespace spartan::internal
