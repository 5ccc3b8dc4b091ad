#include "spartan/figures/colours.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace spartan {
namespace {

TEST(Colours, DivergingColoursAreBlueWhiteRed) {
  const Rgb8 low = cold_to_hot(-1), middle = cold_to_hot(0.5), high = cold_to_hot(2);
  EXPECT_GT(low.b, low.r + 50);
  EXPECT_GT(high.r, high.b + 50);
  EXPECT_GT(std::min({middle.r, middle.g, middle.b}), 250);
}

TEST(Colours, AreWrittenInHexadecimal) {
  EXPECT_EQ(hex({1, 171, 255}), "#01abff");
}

}  // namespace
}  // namespace spartan
