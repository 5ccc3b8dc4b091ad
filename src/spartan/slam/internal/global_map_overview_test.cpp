#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "spartan/slam/global_map.h"
#include "spartan/slam/internal/synthetic_stop_test.h"

namespace spartan {
namespace {

using testing::Ground;
using testing::points_at;
using testing::pose_on_ground;
using testing::rocky_ground;

GlobalMap map_of_two_stops() {
  const Ground ground = rocky_ground();
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  for (const std::int64_t number : {1, 2}) {
    const Pose pose = pose_on_ground(ground, 3.1 * static_cast<double>(number), -0.8, 0.3);
    const LocalMap local = MapGenerator::create({}, ThreadPool(1))
                               ->generate(points_at(ground, pose, static_cast<std::uint64_t>(number)), pose);
    EXPECT_TRUE(map.add(local, {number}, {pose, Matrix6d::Zero()}, Matrix6d::Zero()));
  }
  return map;
}

// By the definition, from the view of all cells.
TEST(GlobalMapOverview, SummarizesTheCellsOfTheView) {
  GlobalMap map = map_of_two_stops();
  const MapView all = *map.view(map.extent());
  for (const int step : {1, 3, 8}) {
    const auto overview = map.overview(step);
    ASSERT_TRUE(overview) << overview.error().message();
    EXPECT_DOUBLE_EQ(overview->cell_m, 0.05 * step);
    std::map<std::pair<int, int>, std::vector<std::pair<int, int>>> members;
    for (int r = 0; r < all.window.height; ++r) {
      for (int c = 0; c < all.window.width; ++c) {
        if (!(all.count(c, r) > 0)) continue;
        const int west = all.window.west + c, north = all.window.north - 1 - r;
        members[{static_cast<int>(std::floor(west / static_cast<double>(step))) - overview->window.west,
                 overview->window.north - 1 - static_cast<int>(std::floor(north / static_cast<double>(step)))}]
            .emplace_back(c, r);
      }
    }
    std::size_t known = 0;
    for (int r = 0; r < overview->window.height; ++r) {
      for (int c = 0; c < overview->window.width; ++c) known += overview->count(c, r) > 0 ? 1 : 0;
    }
    EXPECT_EQ(known, members.size()) << "step " << step;
    for (const auto& [at, cells] : members) {
      double elevation = 0, variance = 0, count = 0, lowest = 1e9;
      bool obstacle = false;
      for (const auto& [c, r] : cells) {
        elevation += all.elevation_m(c, r);
        variance += all.variance_m2(c, r);
        count += all.count(c, r);
        lowest = std::min(lowest, static_cast<double>(all.elevation_min_m(c, r)));
        obstacle = obstacle || all.kind(c, r) == GroundClass::obstacle;
      }
      const auto n = static_cast<double>(cells.size());
      const auto [c, r] = at;
      ASSERT_NEAR(overview->elevation_m(c, r), elevation / n, 1e-4);
      ASSERT_NEAR(overview->variance_m2(c, r), variance / n, 1e-3 * variance / n);
      ASSERT_NEAR(overview->elevation_min_m(c, r), lowest, 1e-4);
      ASSERT_NEAR(overview->count(c, r), count, 1e-4 * count);
      ASSERT_EQ(overview->kind(c, r) == GroundClass::obstacle, obstacle);
    }
  }
}

TEST(GlobalMapOverview, ShowsMapsThatAreTooLargeForAView) {
  const Ground ground = rocky_ground();
  GlobalMap map = map_of_two_stops();
  const Pose pose = pose_on_ground(ground, 900, 700, 0);
  ASSERT_TRUE(map.add(MapGenerator::create({}, ThreadPool(1))->generate(points_at(ground, pose, 3), pose), {3},
                      {pose, Matrix6d::Zero()}, Matrix6d::Zero()));
  EXPECT_FALSE(map.view(map.extent()));
  const int step = map.overview_step(400'000);
  const auto overview = map.overview(step);
  ASSERT_TRUE(overview) << overview.error().message();
  EXPECT_LT(overview->window.cells(), 410'000);
  int known = 0;
  for (int r = 0; r < overview->window.height; ++r) {
    for (int c = 0; c < overview->window.width; ++c) known += overview->count(c, r) > 0 ? 1 : 0;
  }
  EXPECT_GT(known, 10);
  EXPECT_EQ(map.overview(1).error().code, ErrorCode::usage);
}

TEST(GlobalMapOverview, AnEmptyMapHasNone) {
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  EXPECT_EQ(map.overview_step(1000), 1);
  const auto overview = map.overview(4);
  ASSERT_TRUE(overview) << overview.error().message();
  EXPECT_EQ(overview->window.cells(), 0);
}

}  // namespace
}  // namespace spartan
