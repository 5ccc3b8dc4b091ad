#include "spartan/slam/internal/surface_grid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "spartan/slam/internal/synthetic_stop_test.h"

namespace spartan::internal {
namespace {

using testing::Ground;
using testing::points_at;
using testing::pose_on_ground;
using testing::rocky_ground;

Ground plane(double a, double b) {
  return [=](double x, double y) { return 0.1 + a * x + b * y; };
}

// Points at 1 cm spacing in a square around the origin.
std::vector<SurfacePoint> dense_points(const Ground& ground, double half) {
  std::vector<SurfacePoint> points;
  for (double x = -half + 0.005; x < half; x += 0.01) {
    for (double y = -half + 0.005; y < half; y += 0.01)
      points.push_back({Eigen::Vector3d(x, y, ground(x, y)).cast<float>(), 0.01F, {0, 0, -1}, GroundClass::ground});
  }
  return points;
}

TEST(SurfaceGrid, RasterizesAsTheMapGenerator) {
  const Ground ground = rocky_ground();
  const Pose pose = pose_on_ground(ground, 3.21, -1.37, 0.4);
  const std::vector<SurfacePoint> points = points_at(ground, pose, 1);
  const LocalMap map = MapGenerator::create({}, ThreadPool(1))->generate(points, pose);
  const SurfaceGrid from_map = grid_of(map);
  const SurfaceGrid rasterized = rasterize(points, pose, from_map.window, 0.05, MapOptions().min_points);
  int known = 0, other = 0;
  for (int r = 0; r < from_map.window.height; ++r) {
    for (int c = 0; c < from_map.window.width; ++c) {
      const bool a = std::isfinite(from_map.elevation_m(c, r)), b = std::isfinite(rasterized.elevation_m(c, r));
      known += a ? 1 : 0;
      // A point on a cell border may fall to either side because of rounding.
      const bool same = a == b && (!a || (std::abs(from_map.elevation_m(c, r) - rasterized.elevation_m(c, r)) < 1e-5 &&
                                          std::abs(from_map.relief_m(c, r) - rasterized.relief_m(c, r)) < 1e-5 &&
                                          std::abs(from_map.variance_m2(c, r) - rasterized.variance_m2(c, r)) < 1e-8));
      other += same ? 0 : 1;
    }
  }
  EXPECT_GT(known, 3000);
  EXPECT_LT(other, known / 100);
}

TEST(SurfaceGrid, SlopeAndElevationOfAPlaneAreExact) {
  const LatticeWindow window = window_around(0, 0, 0.5, 0.05);
  const SurfaceGrid grid = rasterize(dense_points(plane(0.2, -0.3), 0.5), Pose(), window, 0.05, 2);
  for (const GridCell cell : {GridCell{5, 7}, GridCell{0, 0}, GridCell{19, 19}}) {
    EXPECT_NEAR(grid.slope(cell.column, cell.row).x(), 0.2, 1e-4);
    EXPECT_NEAR(grid.slope(cell.column, cell.row).y(), -0.3, 1e-4);
  }
  EXPECT_NEAR(grid.elevation_at(0.113, -0.271), 0.1 + 0.2 * 0.113 + 0.3 * 0.271, 1e-5);
  EXPECT_TRUE(std::isnan(grid.elevation_at(0.6, 0)));
}

TEST(SurfaceGrid, CoarseCellsLieOnTheCoarseLattice) {
  // Odd borders on both sides of zero.
  const LatticeWindow window{-7, 9, 17, 15};
  const SurfaceGrid fine = rasterize(dense_points(plane(0.2, -0.3), 0.6), Pose(), window, 0.05, 2);
  const SurfaceGrid coarse = coarser(fine);
  EXPECT_EQ(coarse.cell_m, 0.1);
  int known = 0;
  for (int r = 0; r < coarse.window.height; ++r) {
    for (int c = 0; c < coarse.window.width; ++c) {
      const Eigen::Vector2d at = cell_centre(coarse.window.place(0.1), c, r);
      const bool whole = c > 0 && r > 0 && c < coarse.window.width - 1 && r < coarse.window.height - 1;
      if (!whole) continue;
      ++known;
      EXPECT_NEAR(coarse.elevation_m(c, r), 0.1 + 0.2 * at.x() - 0.3 * at.y(), 1e-5);
    }
  }
  EXPECT_GT(known, 20);
}

}  // namespace
}  // namespace spartan::internal
