#include "spartan/reconstruction/internal/matching/search_intervals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "spartan/numerics/random.h"

namespace spartan::internal::matching {
namespace {

constexpr float kUnknownCoarse = std::numeric_limits<float>::quiet_NaN();

bool holds(const TileIntervals& tile, int disparity, int margin) {
  const auto inside = [&](int first) { return disparity - margin >= first && disparity + margin < first + kInterval; };
  return inside(tile.first) || inside(tile.second);
}

TEST(SearchIntervals, HoldTheDisparitiesOfTwoSurfacesWithAMargin) {
  Image<float> coarse(40, 40, 10.0F);  // 20 px at full resolution
  for (int y = 0; y < 40; ++y) {
    for (int x = 20; x < 24; ++x) coarse(x, y) = 45;  // a post, at 90 px
  }
  const auto tiles = choose_intervals(coarse, {80, 80}, {0, 127}, ThreadPool(1));
  ASSERT_EQ(tiles.width(), 10);
  for (int x = 0; x < 10; ++x) {
    EXPECT_TRUE(holds(tiles(x, 5), 20, kMargin - 1)) << x;
    if (x >= 4 && x <= 6) {
      EXPECT_TRUE(holds(tiles(x, 5), 90, kMargin - 1)) << "beside the post too, tile " << x;
    }
  }
}

TEST(SearchIntervals, FollowASlope) {
  Image<float> coarse(64, 64);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) coarse(x, y) = 5 + 0.34F * static_cast<float>(y);
  }
  const auto tiles = choose_intervals(coarse, {128, 128}, {0, 79}, ThreadPool(1));
  for (int y = 0; y < 16; ++y) {
    for (const int row : {8 * y, 8 * y + 7}) {
      const int disparity = static_cast<int>(std::lround(2 * (5 + 0.34 * row / 2)));
      EXPECT_TRUE(holds(tiles(7, y), disparity, 2)) << "row " << row;
    }
  }
}

// Whatever the coarse disparities are: the two intervals do not overlap, are in order, and reach at most one interval
// beyond the range.
TEST(SearchIntervals, AreApartAndNearTheRangeForAnyDisparities) {
  Random random(11);
  for (int trial = 0; trial < 300; ++trial) {
    const ImageSize size{1 + static_cast<int>(random.below(70)), 1 + static_cast<int>(random.below(70))};
    const int min = static_cast<int>(random.below(60)) - 30;
    const DisparityRange range{min, min + static_cast<int>(random.below(90))};
    Image<float> coarse((size.width + 1) / 2, (size.height + 1) / 2, kUnknownCoarse);
    for (int y = 0; y < coarse.height(); ++y) {
      for (int x = 0; x < coarse.width(); ++x) {
        if (random.below(3) > 0) coarse(x, y) = 100 * static_cast<float>(random.uniform() - 0.5);
      }
    }
    const auto tiles = choose_intervals(coarse, size, range, ThreadPool(1));
    ASSERT_EQ(tiles.width(), (size.width + kTile - 1) / kTile);
    for (int y = 0; y < tiles.height(); ++y) {
      for (int x = 0; x < tiles.width(); ++x) {
        const TileIntervals& tile = tiles(x, y);
        ASSERT_GE(tile.second - tile.first, kInterval);
        ASSERT_GE(tile.first, range.min - kInterval);
        ASSERT_LE(tile.second, std::max(range.min, range.max + 1 - kInterval) + kInterval);
      }
    }
  }
}

TEST(SearchIntervals, WithoutDisparitiesAreThoseOfTheTileBefore) {
  Image<float> coarse(32, 4, kUnknownCoarse);
  for (int y = 0; y < 4; ++y) coarse(0, y) = 15;
  const auto tiles = choose_intervals(coarse, {64, 8}, {0, 63}, ThreadPool(1));
  for (int x = 0; x < 8; ++x) EXPECT_TRUE(holds(tiles(x, 0), 30, 2)) << x;
}

}  // namespace
}  // namespace spartan::internal::matching
