#include "spartan/report/internal/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <string>

#include "spartan/figures/html.h"

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

TEST(Page, ListsItsSectionsAndLeavesEmptyOnesOut) {
  const std::string page = html_page("t", "<p>head</p>", {{"Time and memory", "<p>1 s</p>"}, {"Maps", ""}});
  EXPECT_THAT(page, HasSubstr("<a href=\"#time-and-memory\">Time and memory</a>"));
  EXPECT_THAT(page, HasSubstr("<h2 id=\"time-and-memory\">"));
  EXPECT_THAT(page, Not(HasSubstr("Maps")));
}

}  // namespace
}  // namespace spartan::internal
