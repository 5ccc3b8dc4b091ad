#include "spartan/sim/internal/camera/truth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace spartan::sim::internal {
namespace {

TerrainShapeOptions level_ground() {
  TerrainShapeOptions options;
  options.relief_m = options.ripple_height_m = options.dune_height_m = 0;
  return options;
}

RockFieldOptions no_rocks() {
  return {.coverage = 0, .pebbles_per_m2 = 0};
}

TEST(GroundMap, RowsRunSouthwardsAndColumnsEastwards) {
  TerrainShapeOptions slope = level_ground();
  slope.slope_deg = 10;
  slope.slope_heading_deg = 30;
  const TerrainShape shape(slope, 1);
  const RockField rocks(no_rocks(), 1);
  const GroundMap map = map_ground(shape, rocks, {-0.6, 0.2, 1.4, 1.2}, 0.05, ThreadPool(2));
  EXPECT_NEAR(map.west_m, -0.6, 1e-9);
  EXPECT_NEAR(map.north_m, 1.2, 1e-9);
  EXPECT_EQ(map.ground.size(), (ImageSize{40, 20}));
  for (const auto& [column, row] : {std::pair{0, 0}, std::pair{39, 0}, std::pair{0, 19}, std::pair{17, 5}}) {
    const double height = shape.height(-0.6 + 0.05 * (column + 0.5), 1.2 - 0.05 * (row + 0.5));
    EXPECT_NEAR(map.ground(column, row), height, 1e-6);
    EXPECT_EQ(map.surface(column, row), map.ground(column, row));
    EXPECT_EQ(map.level(column, row), map.ground(column, row));
  }
  EXPECT_GT(map.ground(39, 0), map.ground(0, 19)) << "the terrain rises to the north-east";
}

TEST(GroundMap, RocksHaveTheirListedHeightAndTheRestIsGround) {
  const TerrainShape shape(level_ground(), 1);
  const RockField field({.coverage = 0.2, .pebbles_per_m2 = 0}, 5);
  const Region region{-3, -3, 3, 3};
  const GroundMap map = map_ground(shape, field, region, 0.01, ThreadPool(2));
  const std::vector<Rock> rocks = field.rocks_in(region.grown(3));
  int large = 0, bare = 0;
  for (const Rock& rock : rocks) {
    if (rock.diameter_m < 0.2 || !region.grown(-0.8).contains(rock.x, rock.y)) continue;
    ++large;
    float top = 0;
    const int reach = static_cast<int>(rock.diameter_m / 0.01);
    const int column = static_cast<int>((rock.x - map.west_m) / 0.01),
              row = static_cast<int>((map.north_m - rock.y) / 0.01);
    for (int j = -reach; j <= reach; ++j) {
      for (int i = -reach; i <= reach; ++i) {
        if (std::hypot(i, j) * 0.01 < 0.5 * rock.diameter_m)
          top = std::max(top, map.surface(column + i, row + j) - map.ground(column + i, row + j));
      }
    }
    EXPECT_GT(top, 0.95 * rock.height_m);
  }
  EXPECT_GT(large, 5);
  for (int row = 0; row < map.ground.height(); row += 7) {
    for (int column = 0; column < map.ground.width(); column += 7) {
      const double x = map.west_m + (column + 0.5) * 0.01, y = map.north_m - (row + 0.5) * 0.01;
      const bool clear = std::none_of(rocks.begin(), rocks.end(), [&](const Rock& rock) {
        return std::hypot(rock.x - x, rock.y - y) < 1.2 * rock.diameter_m;
      });
      if (!clear) continue;
      EXPECT_EQ(map.surface(column, row), map.ground(column, row));
      ++bare;
    }
  }
  EXPECT_GT(bare, 100);
}

TEST(GroundMap, CavitiesAreBelowTheLevel) {
  TerrainShapeOptions pitted = level_ground();
  pitted.cavities_per_100m2 = 20;
  const TerrainShape shape(pitted, 2);
  const GroundMap map = map_ground(shape, RockField(no_rocks(), 1), {-5, -5, 5, 5}, 0.05, ThreadPool(1));
  int deep = 0;
  for (int row = 0; row < map.ground.height(); ++row) {
    for (int column = 0; column < map.ground.width(); ++column) {
      const double x = map.west_m + (column + 0.5) * 0.05, y = map.north_m - (row + 0.5) * 0.05;
      ASSERT_NEAR(map.level(column, row) - map.ground(column, row), shape.cavity_depth(x, y), 1e-6);
      deep += shape.cavity_depth(x, y) > 0.1 ? 1 : 0;
    }
  }
  EXPECT_GT(deep, 20);
  const Image<float> kinds = classify_ground(map, 0.1, 0.1);
  int classed = 0;
  for (int row = 0; row < kinds.height(); ++row) {
    for (int column = 0; column < kinds.width(); ++column) classed += kinds(column, row) == 3 ? 1 : 0;
  }
  EXPECT_EQ(classed, deep);
}

// Cells of bare ground, a low and a high rock, a shallow and a deep cavity, and rocks in a cavity: below the level of
// the ground around it, and above it.
TEST(GroundMap, ClassesFollowHeightAboveAndDepthBelowTheLevel) {
  GroundMap map;
  for (Image<float>* image : {&map.surface, &map.ground, &map.level}) *image = Image<float>(7, 1);
  const auto cell = [&](int i, float surface, float ground, float level) {
    map.surface(i, 0) = surface;
    map.ground(i, 0) = ground;
    map.level(i, 0) = level;
  };
  cell(0, 5.0F, 5.0F, 5.0F);
  cell(1, 5.09F, 5.0F, 5.0F);
  cell(2, 5.11F, 5.0F, 5.0F);
  cell(3, 4.81F, 4.81F, 5.0F);
  cell(4, 4.79F, 4.79F, 5.0F);
  cell(5, 4.91F, 4.79F, 5.0F);
  cell(6, 5.12F, 4.79F, 5.0F);
  const Image<float> kinds = classify_ground(map, 0.1, 0.2);
  const std::vector<float> expected{1, 1, 2, 1, 3, 1, 2};
  for (int i = 0; i < 7; ++i) EXPECT_EQ(kinds(i, 0), expected[static_cast<std::size_t>(i)]) << i;
}

}  // namespace
}  // namespace spartan::sim::internal
