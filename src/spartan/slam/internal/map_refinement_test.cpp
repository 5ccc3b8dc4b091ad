#include "spartan/slam/internal/map_refinement.h"

#include <gtest/gtest.h>

#include "spartan/slam/internal/synthetic_stop_test.h"
#include "spartan/testing/numeric_jacobian.h"

namespace spartan::internal {
namespace {

using testing::Ground;
using testing::numeric_jacobian;
using testing::points_at;
using testing::pose_on_ground;
using testing::rocky_ground;

double hills(double x, double y) {
  return 0.1 * std::sin(1.3 * x + 0.4) * std::cos(0.9 * y) + 0.05 * x;
}

// Elevation at a fixed position of the hills moved by η about c, by fixed-point iteration.
double moved_height(const Eigen::Vector3d& c, const Vector6d& eta, double x, double y) {
  Eigen::Vector2d from(x, y);
  double z = 0;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d p(from.x(), from.y(), hills(from.x(), from.y()));
    const Eigen::Vector3d q = moved(Pose(), c, eta) * p;
    from += Eigen::Vector2d(x, y) - q.head<2>();
    z = q.z();
  }
  return z;
}

TEST(MapRefinement, JacobianEqualsTheNumericOneOfAMovedSurface) {
  const Eigen::Vector3d c(0.4, -0.3, 0.2);
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(1, 2), {-1.5, 0.3}, {0.4, -2.2}}) {
    const auto numeric = numeric_jacobian<1, 6>(
        [&](const Vector6d& eta) { return Eigen::Matrix<double, 1, 1>(moved_height(c, eta, at.x(), at.y())); },
        Vector6d::Zero(), 1e-3);
    const double h = 1e-5;
    const Eigen::Vector2d slope((hills(at.x() + h, at.y()) - hills(at.x() - h, at.y())) / (2 * h),
                                (hills(at.x(), at.y() + h) - hills(at.x(), at.y() - h)) / (2 * h));
    const Vector6d j = elevation_jacobian(slope, Eigen::Vector3d(at.x(), at.y(), hills(at.x(), at.y())) - c);
    EXPECT_LT((numeric.transpose() - j).norm(), 1e-6) << at.transpose();
  }
}

TEST(MapRefinement, RayOriginIsTheCameraCentre) {
  const Ground ground = rocky_ground();
  const Eigen::Vector3d camera = ray_origin_of(points_at(ground, pose_on_ground(ground, 1, 2, 0.3), 1));
  EXPECT_LT((camera - Eigen::Vector3d(0, 0, 1)).norm(), 1e-4);
}

TEST(MapRefinement, DownsampledPointsAreTheMeansOfTheirSquares) {
  std::vector<SurfacePoint> points;
  points.reserve(5);
  for (int i = 0; i < 4; ++i) {
    points.push_back(
        {{0.001F * static_cast<float>(i), 0, 0.1F * static_cast<float>(i)}, 0.01F, {0, 0, -1}, GroundClass::ground});
  }
  points.push_back({{1, 1, 1}, 0.02F, {0, 0, -1}, GroundClass::ground});
  const auto means = downsampled(points, 0.0125);
  ASSERT_EQ(means.size(), 2U);
  EXPECT_NEAR(means[0].in_body.z(), 0.15, 1e-6);
  EXPECT_NEAR(means[0].sigma_m, 0.01, 1e-7);
  EXPECT_TRUE(downsampled({}, 0.01).empty());
}

TEST(MapRefinement, WeightsAreDerivativesOfTheRobustCost) {
  const LatticeWindow window = window_around(0, 0, 1, 0.05);
  const auto grid = [&](double height) {
    SurfaceGrid g;
    g.window = window;
    g.elevation_m = Image<float>(window.width, window.height, static_cast<float>(height));
    g.variance_m2 = Image<float>(window.width, window.height, 1e-4F);
    g.relief_m = Image<float>(window.width, window.height, 0.0F);
    return g;
  };
  const MatchOptions options;
  const double s2 = 0.25 * 2e-4 + 0.01 * 0.01, k2 = options.robust_sigmas * options.robust_sigmas;
  const auto cost = [&](double r) { return 0.5 * k2 * s2 * (r * r / (k2 * s2)) / (1 + r * r / (k2 * s2)) / s2; };
  for (const double r : {0.0, 0.01, -0.04, 0.2}) {
    const auto cells = matched_cells(grid(r), grid(0), {{0, 0, 0}, {0, 0, 1}}, {0.01, 0.5}, options);
    ASSERT_EQ(cells.size(), 1600U);
    const double rf = cells[0].residual_m, h = 1e-5;
    EXPECT_NEAR(cells[0].weight * rf, (cost(rf + h) - cost(rf - h)) / (2 * h),
                1e-3 * std::abs(cells[0].weight * rf) + 1e-6);
    EXPECT_NEAR(cells[0].curvature, (cost(rf + h) - 2 * cost(rf) + cost(rf - h)) / (h * h), 1e-3 * cells[0].weight);
    // The camera is 1 m high: a range error of σ / |a_z| raises level ground by σ everywhere.
    EXPECT_NEAR(std::abs(cells[0].common_error_m), std::sqrt(2e-4), 2e-3);
    EXPECT_NEAR(cells[0].relief_error_m, 0, 1e-9) << "level ground has no relief";
  }
}

TEST(MapRefinement, ConvergesFromAnOffset) {
  const Ground ground = rocky_ground();
  const Pose before = pose_on_ground(ground, 0, 0, 0), now = pose_on_ground(ground, 1, 0.2, 0.1);
  const SurfaceGrid global =
      grid_of(MapGenerator::create({}, ThreadPool(1))->generate(points_at(ground, before, 1), before));
  Vector6d eta;
  eta << 0.03, -0.02, 0.02, 0.01, -0.01, 0.015;
  const auto match = refine_match(points_at(ground, now, 2), global, moved(now, now.translation(), eta), 2, {});
  ASSERT_TRUE(match);
  EXPECT_TRUE(match->converged);
  const Pose wrong = now.inverse() * match->world_from_body;
  EXPECT_LT(wrong.translation().norm(), 0.002);
  EXPECT_LT(rotation_angle(wrong), 0.001);
}

TEST(MapRefinement, GivesNothingWithoutOverlap) {
  const Ground ground = rocky_ground();
  const Pose before = pose_on_ground(ground, 0, 0, 0), far = pose_on_ground(ground, 30, 0, 0);
  const SurfaceGrid global =
      grid_of(MapGenerator::create({}, ThreadPool(1))->generate(points_at(ground, before, 1), before));
  EXPECT_FALSE(refine_match(points_at(ground, far, 2), global, far, 2, {}));
}

}  // namespace
}  // namespace spartan::internal
