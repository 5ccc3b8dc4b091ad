#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "spartan/slam/global_map.h"
#include "spartan/slam/internal/synthetic_stop_test.h"

namespace spartan {

using namespace internal;

namespace {

using testing::points_at;
using testing::pose_on_ground;
using testing::rocky_ground;

// Adds a stop on rocky ground with every tenth column marked as an obstacle; returns the window of its local map.
LatticeWindow add_stop(GlobalMap& map, double x, double y, double yaw) {
  const auto ground = rocky_ground();
  const Pose pose = pose_on_ground(ground, x, y, yaw);
  LocalMap local = MapGenerator::create({}, ThreadPool(1))->generate(points_at(ground, pose, 1), pose);
  for (int r = 0; r < local.size().height; ++r) {
    for (int c = 0; c < local.size().width; c += 10) {
      local.kind(c, r) = GroundClass::obstacle;
      local.occupancy_logodds(c, r) = 3;
    }
  }
  EXPECT_TRUE(map.add(local, {}, {pose, Matrix6d::Zero()}, Matrix6d::Zero()));
  return window_of(local.place, local.size());
}

// The same statistics from views that do not overlap.
MapStatistics expected_figures(GlobalMap& map, const std::vector<LatticeWindow>& windows) {
  MapStatistics statistics;
  std::vector<float> variances, elevations;
  for (const LatticeWindow& window : windows) {
    const MapView view = *map.view(window);
    for (int r = 0; r < window.height; ++r) {
      for (int c = 0; c < window.width; ++c) {
        if (!(view.count(c, r) > 0)) continue;
        ++statistics.cells[static_cast<std::size_t>(view.kind(c, r))];
        elevations.push_back(view.elevation_m(c, r));
        variances.push_back(view.variance_m2(c, r));
      }
    }
  }
  std::sort(variances.begin(), variances.end());
  statistics.known = static_cast<std::int64_t>(variances.size());
  statistics.min_elevation_m = *std::min_element(elevations.begin(), elevations.end());
  statistics.max_elevation_m = *std::max_element(elevations.begin(), elevations.end());
  statistics.median_variance_m2 = variances[variances.size() / 2];
  return statistics;
}

void expect_same(const MapStatistics& a, const MapStatistics& b) {
  EXPECT_EQ(a.cells, b.cells);
  EXPECT_EQ(a.known, b.known);
  EXPECT_EQ(a.min_elevation_m, b.min_elevation_m);
  EXPECT_EQ(a.max_elevation_m, b.max_elevation_m);
  EXPECT_EQ(a.median_variance_m2, b.median_variance_m2);
}

TEST(MapStatistics, DoNotDependOnTheSizeOfTheWindows) {
  GlobalMapOptions options;
  options.submap_m = 2;
  GlobalMap map = GlobalMap::create(options, 0.05).value();
  for (int i = 0; i < 4; ++i) add_stop(map, 1.5 * i, 0.3 * i, 0.4 * i);
  ASSERT_GT(map.submaps().size(), 1U);
  const MapStatistics whole = expected_figures(map, {map.extent()});
  EXPECT_GT(whole.cells[1], 3000);
  EXPECT_GT(whole.cells[2], 100);
  for (const int side : {37, 64, 512}) {
    const auto statistics = map_statistics(map, side);
    ASSERT_TRUE(statistics);
    SCOPED_TRACE(side);
    expect_same(*statistics, whole);
  }
}

TEST(MapStatistics, OfAMapThatIsTooLargeForOneView) {
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  const LatticeWindow one = add_stop(map, -3, 2, 0.3), other = add_stop(map, 300, 200, 2);
  ASSERT_GT(map.extent().cells(), GlobalMap::kMostCells);
  ASSERT_FALSE(map.view(map.extent()));
  const auto statistics = map_statistics(map);
  ASSERT_TRUE(statistics);
  expect_same(*statistics, expected_figures(map, {one, other}));
}

TEST(MapStatistics, OfAnEmptyMapAreZero) {
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  const auto statistics = map_statistics(map);
  ASSERT_TRUE(statistics);
  expect_same(*statistics, {});
}

}  // namespace
}  // namespace spartan
