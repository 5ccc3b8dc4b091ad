#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "spartan/reconstruction/map_generator.h"

namespace spartan {
namespace {

constexpr double kCell_m = 0.05;
constexpr int kSide = 80;

using Height = std::function<double(double, double)>;

Image<float> grid_of(const Height& height) {
  Image<float> image(kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) image(x, y) = static_cast<float>(height(x * kCell_m, y * kCell_m));
  }
  return image;
}

Image<std::uint8_t> everywhere(std::uint8_t value) {
  return {kSide, kSide, value};
}

double worst_of(const Image<float>& fitted, const Height& truth) {
  double worst = 0;
  for (int y = 4; y < kSide - 4; ++y) {
    for (int x = 4; x < kSide - 4; ++x)
      worst = std::max(worst, std::abs(fitted(x, y) - truth(x * kCell_m, y * kCell_m)));
  }
  return worst;
}

const Height kSlope = [](double x, double y) { return 0.3 * x - 0.1 * y; };

TEST(GroundSurface, ReproducesASlope) {
  EXPECT_LT(worst_of(fit_ground(grid_of(kSlope), everywhere(1), kCell_m, {}, ThreadPool(1)), kSlope), 1e-4);
}

// Two rocks and a pit that are not marked.
TEST(GroundSurface, ContinuesBeneathRocksAndAbovePits) {
  const Height cluttered = [](double x, double y) {
    double z = kSlope(x, y);
    if (std::hypot(x - 1.5, y - 1.5) < 0.35) z += 0.25;
    if (std::hypot(x - 2.8, y - 2.2) < 0.2) z += 0.12;
    if (std::hypot(x - 1.2, y - 3.0) < 0.3) z -= 0.3;
    return z;
  };
  EXPECT_LT(worst_of(fit_ground(grid_of(cluttered), everywhere(1), kCell_m, {}, ThreadPool(2)), kSlope), 0.01);
}

// A ridge whose sides fall by 20 degrees within half a metre.
TEST(GroundSurface, FollowsARidge) {
  const Height ridge = [](double x, double) {
    const double distance = std::abs(x - 2);
    return distance < 0.5 ? -0.364 * distance * distance : -0.364 * (distance - 0.25);
  };
  EXPECT_LT(worst_of(fit_ground(grid_of(ridge), everywhere(1), kCell_m, {}, ThreadPool(1)), ridge), 0.05);
}

TEST(GroundSurface, BridgesHolesAndIsUnknownWithoutData) {
  Image<float> with_holes = grid_of(kSlope);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      if (std::hypot(x - 40, y - 40) < 6 || y < 3) with_holes(x, y) = nan;
    }
  }
  EXPECT_LT(worst_of(fit_ground(with_holes, everywhere(1), kCell_m, {}, ThreadPool(1)), kSlope), 1e-3);
  const Image<float> nothing(kSide, kSide, nan);
  EXPECT_TRUE(std::isnan(fit_ground(nothing, everywhere(1), kCell_m, {}, ThreadPool(1))(40, 40)));
}

TEST(GroundSurface, IsDeterministicForAnyNumberOfThreads) {
  const Image<float> grid = grid_of([](double x, double y) { return 0.1 * std::sin(5 * x) * std::cos(3 * y); });
  const Image<float> one = fit_ground(grid, everywhere(1), kCell_m, {}, ThreadPool(1)),
                     two = fit_ground(grid, everywhere(1), kCell_m, {}, ThreadPool(2));
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) EXPECT_EQ(one(x, y), two(x, y));
  }
}

}  // namespace
}  // namespace spartan
