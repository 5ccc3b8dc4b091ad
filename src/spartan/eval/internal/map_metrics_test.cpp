#include "spartan/eval/internal/map_metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace spartan::internal {
namespace {

// Level ground of 4 m x 4 m at 2 cm with a rock of 0.2 m height and 0.4 m side around (1, 1) and a pit of 0.3 m depth
// and 0.6 m side around (-1, -1); a map of it with cells of 10 cm that is correct everywhere.
struct Case {
  Image<float> surface{200, 200, 1.0F}, ground{200, 200, 1.0F}, level{200, 200, 1.0F};
  Image<float> elevation{40, 40, 1.0F}, kind{40, 40, 1.0F};
  Image<std::uint16_t> visible{40, 40, 10};
  Image<float> lowest_seen{40, 40, 1.0F};
  GeoTransform place{-2, 2, 0.1};

  Case() {
    box(surface, 200, 0.02, 0.8, 1.2, 0.8, 1.2, 1.2F);
    box(surface, 200, 0.02, -1.3, -0.7, -1.3, -0.7, 0.7F);
    box(ground, 200, 0.02, -1.3, -0.7, -1.3, -0.7, 0.7F);
    box(elevation, 40, 0.1, 0.8, 1.2, 0.8, 1.2, 1.2F);
    box(elevation, 40, 0.1, -1.3, -0.7, -1.3, -0.7, 0.7F);
    box(kind, 40, 0.1, 0.8, 1.2, 0.8, 1.2, 2.0F);
    box(kind, 40, 0.1, -1.3, -0.7, -1.3, -0.7, 3.0F);
    box(lowest_seen, 40, 0.1, -1.3, -0.7, -1.3, -0.7, 0.7F);
  }
  static void box(Image<float>& image, int side, double cell, double x0, double x1, double y0, double y1, float value) {
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) {
        const double x = -2 + (i + 0.5) * cell, y = 2 - (j + 0.5) * cell;
        if (x > x0 && x < x1 && y > y0 && y < y1) image(i, j) = value;
      }
    }
  }
  MapMetrics evaluate(const MapMetricsOptions& scoring = {}) const {
    return evaluate_map({place, elevation, kind, visible, lowest_seen}, {{-2, 2, 0.02}, surface, ground, level},
                        scoring);
  }
  static int column(double x) { return static_cast<int>((x + 2) / 0.1); }
  static int row(double y) { return static_cast<int>((2 - y) / 0.1); }
};

TEST(MapMetrics, ACorrectMapHasNoErrors) {
  const MapMetrics m = Case().evaluate();
  EXPECT_EQ(m.elevation_cells, 1600);
  EXPECT_NEAR(m.rms_m, 0, 1e-6);
  EXPECT_EQ(m.coverage(), 1);
  EXPECT_EQ(m.false_cells, 0);
  EXPECT_EQ(m.free_cells, 1600 - 16 - 36);
  ASSERT_EQ(m.obstacles.size(), 1U);
  EXPECT_NEAR(m.obstacles[0].height_m, 0.2, 1e-6);
  EXPECT_EQ(m.obstacles[0].visible_cells, 16);
  EXPECT_TRUE(m.obstacles[0].found);
  ASSERT_EQ(m.cavities.size(), 1U);
  EXPECT_NEAR(m.cavities[0].height_m, 0.3, 1e-6);
  EXPECT_TRUE(m.cavities[0].found);
  EXPECT_EQ(m.confusion[1][1], 1600 - 16 - 36);
  EXPECT_EQ(m.confusion[2][2], 16);
  EXPECT_EQ(m.confusion[3][3], 36);
  EXPECT_EQ(m.confusion[1][2] + m.confusion[2][1] + m.confusion[1][3], 0);
}

TEST(MapMetrics, ElevationErrorsCountOnFlatCells) {
  Case c;
  for (int i = 0; i < 40; ++i) c.elevation(i, 30) += 0.02F;
  c.surface(Case::column(0) * 5 + 2, Case::row(0.05) * 5 + 2) = 1.06F;  // a stone: relief over 5 cm
  c.elevation(Case::column(0.05), Case::row(0.05)) = 5;
  const MapMetrics m = c.evaluate();
  EXPECT_EQ(m.elevation_cells, 1599);
  EXPECT_NEAR(m.bias_m, 40 * 0.02 / 1599, 1e-6);
  EXPECT_NEAR(m.rms_m, std::sqrt(40 * 0.02 * 0.02 / 1599), 1e-6);
}

TEST(MapMetrics, UnknownVisibleCellsLowerTheCoverage) {
  Case c;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (int i = 0; i < 10; ++i) {
    c.elevation(i, 20) = nan;
    c.kind(i, 20) = 0;
    c.elevation(i, 21) = nan;
    c.kind(i, 21) = 0;
    c.visible(i, 21) = 3;  // one pixel short
  }
  const MapMetrics m = c.evaluate();
  EXPECT_EQ(m.visible_cells, 1590);
  EXPECT_EQ(m.covered_cells, 1580);
  EXPECT_EQ(m.confusion[1][0], 10);
}

TEST(MapMetrics, AnObstacleIsDetectedByAThirdOfItsCells) {
  Case c;
  Case::box(c.kind, 40, 0.1, 0.8, 1.2, 0.8, 1.2, 1.0F);
  for (int i = 0; i < 4; ++i) c.kind(Case::column(0.85) + i, Case::row(1.15)) = 2;
  EXPECT_FALSE(c.evaluate().obstacles[0].found) << "4 of 16";
  c.kind(Case::column(0.85), Case::row(1.05)) = 2;
  EXPECT_TRUE(c.evaluate().obstacles[0].found) << "5 of 16";
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 4; ++i) c.visible(Case::column(0.85) + i, Case::row(1.15) + j) = 0;
  }
  EXPECT_TRUE(c.evaluate().obstacles.empty()) << "no camera sees it";
}

TEST(MapMetrics, ACavityCountsWhereTenCentimetersOfDepthAreVisible) {
  Case c;
  Case::box(c.lowest_seen, 40, 0.1, -1.3, -0.7, -1.3, -0.7, 0.91F);
  EXPECT_TRUE(c.evaluate().cavities.empty()) << "only its edge is visible";
  Case::box(c.lowest_seen, 40, 0.1, -0.9, -0.7, -0.9, -0.7, 0.85F);
  const MapMetrics m = c.evaluate();
  ASSERT_EQ(m.cavities.size(), 1U);
  EXPECT_NEAR(m.cavities[0].seen_depth_m, 0.15, 1e-6);
  EXPECT_NEAR(m.cavities[0].middle_m.x(), -1, 1e-6);
  EXPECT_NEAR(m.cavities[0].middle_m.y(), -1, 1e-6);
}

TEST(MapMetrics, FalsePositivesAreTwoCellsFromAnyObstacle) {
  Case c;
  c.kind(Case::column(1.25), Case::row(1.05)) = 2;  // beside the rock
  EXPECT_EQ(c.evaluate().false_cells, 0);
  c.kind(Case::column(1.35), Case::row(1.05)) = 2;
  EXPECT_EQ(c.evaluate().false_cells, 1);
  c.kind(Case::column(-1.05), Case::row(-1.05)) = 2;  // the pit is no obstacle, and not free either
  const MapMetrics m = c.evaluate();
  EXPECT_EQ(m.false_cells, 1);
  EXPECT_EQ(m.confusion[3][2], 1);
}

TEST(MapMetrics, RangesPartitionTheCells) {
  MapMetricsOptions near, far;
  near.farthest_m = far.nearest_m = 1.0;
  const Case c;
  const MapMetrics a = c.evaluate(near), b = c.evaluate(far), all = c.evaluate();
  EXPECT_EQ(a.visible_cells + b.visible_cells, all.visible_cells);
  EXPECT_GT(a.visible_cells, 300);
  EXPECT_TRUE(a.obstacles.empty());
  EXPECT_EQ(b.obstacles.size(), 1U);
}

TEST(MapMetrics, CellsOutsideTheTruthAreIgnored) {
  Case c;
  c.place.west_m -= 1;  // ten columns lie outside
  EXPECT_EQ(c.evaluate().visible_cells, 1200);
}

}  // namespace
}  // namespace spartan::internal
