#include "spartan/slam/internal/match_covariance.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "spartan/numerics/random.h"

namespace spartan::internal {
namespace {

constexpr double kNoise_m = 0.02;

// Cells of 4 m × 4 m with slopes of the given spread, measured twice with noise; residuals of the pose η = 0 after the
// linear fit, and that fit's error.
struct Drawn {
  std::vector<MatchedCell> cells;
  Vector6d error = Vector6d::Zero();
};
Drawn draw(Random& random, double slope, double slope_noise, double across = 1) {
  Drawn drawn;
  Matrix6d normal = Matrix6d::Zero();
  Vector6d right = Vector6d::Zero();
  for (int row = 0; row < 80; ++row) {
    for (int column = 0; column < 80; ++column) {
      const Eigen::Vector2d s(slope * random.normal(), across * slope * random.normal());
      const auto measured_slope = [&] {
        return Eigen::Vector2d(s.x() + slope_noise * random.normal(), s.y() + slope_noise * random.normal());
      };
      const Eigen::Vector3d at((column - 40) * 0.05 + 1, (40 - row) * 0.05, 0);
      MatchedCell cell;
      cell.row = row;
      cell.column = column;
      cell.sigma_m = kNoise_m;
      cell.weight = cell.curvature = 1 / (kNoise_m * kNoise_m);
      cell.residual_m = kNoise_m * random.normal();
      cell.jacobian_by_local = elevation_jacobian(measured_slope(), at);
      cell.jacobian_by_global = elevation_jacobian(measured_slope(), at);
      const Vector6d j = cell.jacobian();
      normal += j * j.transpose();
      right += cell.residual_m * j;
      drawn.cells.push_back(cell);
    }
  }
  drawn.error = -normal.ldlt().solve(right);
  for (MatchedCell& cell : drawn.cells) cell.residual_m += cell.jacobian().dot(drawn.error);
  return drawn;
}

TEST(MatchCovariance, IsConsistentWithTheErrors) {
  MatchOptions options;
  options.common_error_ratio = 0;
  Random random(5);
  double nees = 0;
  constexpr int kDraws = 40;
  for (int i = 0; i < kDraws; ++i) {
    const Drawn drawn = draw(random, 0.1, 0);
    const MatchCovariance covariance = estimate_match_covariance(drawn.cells, 0.05, options);
    ASSERT_EQ(covariance.determined, 6);
    EXPECT_NEAR(covariance.normalized_residual, 1, 0.05);
    nees += drawn.error.dot(covariance.information * drawn.error) / kDraws;
  }
  // Mean of χ² with 6 degrees of freedom over 40 draws: 6 ± 0.55; with 64 blocks it is a few percent wider.
  EXPECT_GT(nees, 4.3);
  EXPECT_LT(nees, 7.9);
}

TEST(MatchCovariance, NoiseOfTheSlopesIsNotRelief) {
  Random random(6);
  const MatchOptions options;
  // With noise alone the curvature along x and y may have either sign, but the directions are undetermined.
  for (int i = 0; i < 5; ++i) {
    const MatchCovariance covariance = estimate_match_covariance(draw(random, 0, 0.05).cells, 0.05, options);
    EXPECT_LE(covariance.determined, 4) << "height, roll and pitch, and at most one by chance";
    // The horizontal directions are not determined.
    EXPECT_LT(covariance.information(0, 0), 1e-2 * covariance.information(2, 2));
  }
}

TEST(MatchCovariance, HasNoInformationAlongARidge) {
  Random random(7);
  const MatchCovariance covariance = estimate_match_covariance(draw(random, 0.1, 0, 0).cells, 0.05, {});
  EXPECT_EQ(covariance.determined, 5);
  Vector6d along = Vector6d::Zero();
  along[1] = 1;
  EXPECT_LT(along.dot(covariance.information * along), 1e-3 * covariance.information(0, 0));
}

TEST(MatchCovariance, OneStoneDoesNotDetermineAllDirections) {
  Random random(8);
  Drawn drawn = draw(random, 0, 0);
  for (MatchedCell& cell : drawn.cells) {
    if (cell.row < 20 || cell.row >= 26 || cell.column < 20 || cell.column >= 26) continue;
    const Eigen::Vector2d slope(random.normal(), random.normal());
    cell.jacobian_by_local = cell.jacobian_by_global = elevation_jacobian(slope, {0, 0, 0});
  }
  EXPECT_LT(estimate_match_covariance(drawn.cells, 0.05, {}).determined, 6);
}

TEST(MatchCovariance, CommonErrorsInflateIt) {
  Random random(9);
  Drawn drawn = draw(random, 0.1, 0);
  for (MatchedCell& cell : drawn.cells) cell.common_error_m = 0.02;
  MatchOptions alone;
  alone.common_error_ratio = 0;
  const MatchCovariance without = estimate_match_covariance(drawn.cells, 0.05, alone),
                        with = estimate_match_covariance(drawn.cells, 0.05, {});
  // Nine level areas of 1.5 m, each with a common error of 22 mm: the standard deviation of the height is 22 / 3 mm.
  EXPECT_LT(without.information.inverse()(2, 2), 1e-6);
  EXPECT_NEAR(std::sqrt(with.information.inverse()(2, 2)), 0.022 / 3, 0.004);
}

TEST(MatchCovariance, FrontoParallelBiasInflatesItWithoutChangingTheRank) {
  Random random(10);
  Drawn drawn = draw(random, 0.1, 0);
  // All relief is biased by 1 cm along x: the residuals are those of a translation by 1 cm.
  for (MatchedCell& cell : drawn.cells) cell.relief_error_m = 0.01 * cell.jacobian()[0];
  MatchOptions options;
  options.relief_error_ratio = 0;
  const MatchCovariance without = estimate_match_covariance(drawn.cells, 0.05, options);
  options.relief_error_ratio = 1;
  const MatchCovariance with = estimate_match_covariance(drawn.cells, 0.05, options);
  EXPECT_EQ(with.determined, without.determined) << "the bias does not change which directions are determined";
  const Matrix6d more = with.information.inverse() - without.information.inverse();
  EXPECT_NEAR(std::sqrt(more(0, 0)), 0.01, 0.001);
  EXPECT_LT(std::sqrt(more(1, 1)), 0.001);
}

TEST(MatchCovariance, AFewDifferentStonesDetermineAllDirections) {
  Random random(11);
  Drawn drawn = draw(random, 0, 0.01);
  for (MatchedCell& cell : drawn.cells) {
    const bool steep = cell.row < 5 && cell.column < 5, low = cell.row >= 75 && (cell.column < 5 || cell.column >= 75);
    if (!steep && !low) continue;
    const double slope = steep ? 1 : 0.5;
    const Eigen::Vector3d at((cell.column - 40) * 0.05 + 1, (40 - cell.row) * 0.05, 0);
    cell.jacobian_by_local = cell.jacobian_by_global =
        elevation_jacobian({slope * random.normal(), slope * random.normal()}, at);
  }
  EXPECT_EQ(estimate_match_covariance(drawn.cells, 0.05, {}).determined, 6);
}

TEST(MatchCost, IsTheMeanOfTheCells) {
  std::vector<MatchedCell> cells(400);
  for (int i = 0; i < 400; ++i) {
    cells[static_cast<std::size_t>(i)].column = i;
    cells[static_cast<std::size_t>(i)].sigma_m = 0.01;
    cells[static_cast<std::size_t>(i)].residual_m = i < 200 ? 0.0 : 0.03;
  }
  MatchOptions options;
  options.block_m = 0.5;
  const MatchCost cost = cost_of(cells, 0.05, 1, options);  // k σ = 3 cm: a cost of a half for every second cell
  EXPECT_NEAR(cost.mean, 0.25, 1e-12);
  // 40 blocks of 10 cells, each with a mean that deviates by 0.25.
  EXPECT_NEAR(cost.variance, 0.0625 / 39, 1e-9);
}

}  // namespace
}  // namespace spartan::internal
