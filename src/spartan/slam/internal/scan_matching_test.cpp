#include "spartan/slam/internal/scan_matching.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "spartan/slam/internal/synthetic_stop_test.h"

namespace spartan::internal {
namespace {

using testing::covariance_of;
using testing::Ground;
using testing::points_at;
using testing::pose_at;
using testing::pose_on_ground;
using testing::rocky_ground;

SurfaceGrid map_at(const std::vector<SurfacePoint>& points, const Pose& pose) {
  return coarser(grid_of(MapGenerator::create({}, ThreadPool(1))->generate(points, pose)));
}

TEST(ScanMatching, WindowFollowsTheCovarianceInWorldAxes) {
  MatchOptions options;
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal() << 0.01, 0.0001, 1, 1, 1, 0.0004;
  // Yaw of 90 degrees: the body's x axis is the world's y axis.
  const SearchWindow window = search_window({pose_at(0, 0, 0, M_PI / 2), covariance}, options);
  EXPECT_NEAR(window.y_m, 0.3, 1e-9);
  EXPECT_NEAR(window.x_m, options.step_m, 1e-9) << "at least a step";
  EXPECT_NEAR(window.yaw_rad, 0.06, 1e-9);
  EXPECT_NEAR(search_window({Pose(), covariance_of(9, 9)}, options).x_m, options.max_search_m, 1e-9);
}

TEST(ScanMatching, FindsTheOffsetWithinAStep) {
  const Ground ground = rocky_ground();
  const Pose before = pose_on_ground(ground, 0, 0, 0), now = pose_on_ground(ground, 1, 0.2, 0.1);
  const Pose offset = pose_at(0.2, -0.15, 0.1, 0.05) * Pose::from_rotation(exp_so3({0.03, -0.02, 0}));
  const Pose prior =
      Pose::from_translation(now.translation()) * offset * Pose::from_translation(-now.translation()) * now;
  const std::vector<ScanMatchPeak> peaks =
      correlative_scan_match(map_at(points_at(ground, now, 2), prior), map_at(points_at(ground, before, 1), before),
                             prior.translation(), {0.3, 0.3, 0.07}, {}, ThreadPool(2));
  ASSERT_FALSE(peaks.empty());
  const Pose wrong = now.inverse() * peaks.front().correction * prior;
  EXPECT_LT(wrong.translation().norm(), 0.06);
  EXPECT_LT(rotation_angle(wrong), 0.02);
  EXPECT_FALSE(peaks.front().at_edge);
  for (std::size_t i = 1; i < peaks.size(); ++i) EXPECT_LE(peaks[i - 1].cost, peaks[i].cost);
}

TEST(ScanMatching, OccupancyDecidesWhereElevationsAreEqual) {
  // A plane with three obstacle cells whose elevation is that of their surroundings.
  const auto plain = [](double east) {
    SurfaceGrid grid = rasterize(points_at([](double, double) { return 0.0; }, Pose(), 1, 0), Pose(),
                                 window_around(2, 0, 3, 0.1), 0.1, 1);
    for (const Eigen::Vector2d& at : {Eigen::Vector2d(1.55, 0.35), {2.55, -0.75}, {2.95, 0.85}}) {
      const GridCell cell = cell_at(grid.window.place(0.1), at.x() + east, at.y());
      for (int k = 0; k < 9; ++k) grid.occupancy(cell.column + k % 3, cell.row + k / 3) = 1;
    }
    for (int r = 0; r < grid.window.height; ++r) {
      for (int c = 0; c < grid.window.width; ++c)
        if (grid.occupancy(c, r) != 1) grid.occupancy(c, r) = -1;
    }
    return grid;
  };
  const auto peaks = correlative_scan_match(plain(0.2), plain(0), {2, 0, 0}, {0.4, 0.4, 0.02}, {}, ThreadPool(1));
  ASSERT_FALSE(peaks.empty());
  EXPECT_NEAR((peaks.front().correction * Eigen::Vector3d(2, 0, 0)).x(), 1.8, 0.051);
}

TEST(ScanMatching, RejectsASearchThatIsTooLarge) {
  MatchOptions options;
  EXPECT_TRUE(validate(options, "match"));
  options.max_search_m = 10;
  EXPECT_TRUE(validate(options, "match")) << "401 x 401 shifts, 17 rotations";
  options.step_m = 0.005;
  options.step_deg = 0.05;
  options.max_search_deg = 60;  // 4001 x 4001 shifts, 2401 rotations: more trials than an int counts
  const Status refused = validate(options, "match");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::configuration);
  EXPECT_NE(refused.error().message().find("step_m"), std::string::npos) << refused.error().message();
  EXPECT_FALSE(parse_options<MatchOptions>("{widest_m: 10, step_m: 0.005, step_deg: 0.05}", "match.yaml"));
  SurfaceGrid none;
  none.cell_m = 0.1;
  EXPECT_THROW(correlative_scan_match(none, none, {0, 0, 0}, {10, 10, 1.05}, options, ThreadPool(1)),
               std::invalid_argument);
}

}  // namespace
}  // namespace spartan::internal
