#include "spartan/numerics/connected_components.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <string>

#include "spartan/numerics/random.h"

namespace spartan {
namespace {

Image<std::uint8_t> mask_of(const std::vector<std::string>& rows) {
  Image<std::uint8_t> mask(static_cast<int>(rows[0].size()), static_cast<int>(rows.size()));
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      mask(x, y) = rows[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] == '#' ? 255 : 0;
    }
  }
  return mask;
}

TEST(ConnectedComponents, JoinsDiagonalNeighborsAndKeepsRasterOrder) {
  const auto components = connected_components(mask_of({"#..##",  //
                                                        ".#...",  //
                                                        "#...#"}));
  ASSERT_EQ(components.size(), 3U);
  EXPECT_EQ(components[0], (std::vector<PixelIndex>{{0, 0}, {1, 1}, {0, 2}}));
  EXPECT_EQ(components[1], (std::vector<PixelIndex>{{3, 0}, {4, 0}}));
  EXPECT_EQ(components[2], (std::vector<PixelIndex>{{4, 2}}));
}

TEST(ConnectedComponents, EmptyAndFullMasks) {
  EXPECT_TRUE(connected_components(Image<std::uint8_t>()).empty());
  EXPECT_TRUE(connected_components(Image<std::uint8_t>(4, 3)).empty());
  const auto full = connected_components(Image<std::uint8_t>(4, 3, 1));
  ASSERT_EQ(full.size(), 1U);
  EXPECT_EQ(full[0].size(), 12U);
}

// Against repeated propagation of labels until nothing changes.
RC_GTEST_PROP(ConnectedComponents, AgreesWithPropagatedLabels, (std::uint32_t seed)) {
  Random random(seed);
  const int width = 1 + static_cast<int>(random.below(12)), height = 1 + static_cast<int>(random.below(12));
  Image<std::uint8_t> mask(width, height);
  Image<int> label(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      mask(x, y) = random.below(100) < 40 ? 1 : 0;
      label(x, y) = y * width + x;
    }
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (int j = std::max(y - 1, 0); j <= std::min(y + 1, height - 1); ++j) {
          for (int i = std::max(x - 1, 0); i <= std::min(x + 1, width - 1); ++i) {
            if (mask(x, y) == 0 || mask(i, j) == 0 || label(i, j) >= label(x, y)) continue;
            label(x, y) = label(i, j);
            changed = true;
          }
        }
      }
    }
  }
  std::size_t pixels = 0;
  int previous = -1;
  for (const auto& component : connected_components(mask)) {
    const int expected = label(component.front().x, component.front().y);
    RC_ASSERT(expected == component.front().y * width + component.front().x);
    RC_ASSERT(expected > previous);
    previous = expected;
    for (const PixelIndex& p : component) {
      RC_ASSERT(mask(p.x, p.y) != 0);
      RC_ASSERT(label(p.x, p.y) == expected);
    }
    pixels += component.size();
  }
  std::size_t expected_pixels = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) expected_pixels += mask(x, y);
  }
  RC_ASSERT(pixels == expected_pixels);
}

}  // namespace
}  // namespace spartan
