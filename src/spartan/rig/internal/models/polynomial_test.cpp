#include "spartan/rig/internal/models/polynomial.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace spartan::internal {
namespace {

TEST(Polynomial, FindsExactlyTheSignChanges) {
  // (s − 1)(s − 2)(s − 4)², with a double root that does not change the sign.
  const Polynomial p = product(product({-1, 1}, {-2, 1}), product({-4, 1}, {-4, 1}));
  const auto roots = sign_changes(p, 0, 10);
  ASSERT_EQ(roots.size(), 2u);
  EXPECT_NEAR(roots[0], 1, 1e-12);
  EXPECT_NEAR(roots[1], 2, 1e-12);
  EXPECT_TRUE(sign_changes(p, 2.5, 10).empty());
  EXPECT_TRUE(sign_changes({1, 0, 0}, 0, 10).empty());
}

TEST(SolveIncreasing, InvertsInsideTheRangeOnly) {
  const auto cube = [](double x) { return ValueWithDerivative{x * x * x, 3 * x * x}; };
  for (const double target : {0.0, 1e-9, 0.5, 8.0, 26.9}) {
    const auto x = solve_increasing(cube, target, 0, 3, 2);
    ASSERT_TRUE(x) << target;
    EXPECT_NEAR(*x, std::cbrt(target), 1e-12) << target;
  }
  EXPECT_FALSE(solve_increasing(cube, 28, 0, 3, 2));
  EXPECT_FALSE(solve_increasing(cube, -1, 0, 3, 2));
  EXPECT_FALSE(solve_increasing(cube, std::numeric_limits<double>::quiet_NaN(), 0, 3, 2));
  EXPECT_NEAR(*solve_increasing(cube, 1e9, 0, std::numeric_limits<double>::infinity(), 2), 1000, 1e-9);
}

// A step function for which plain Newton iterations diverge.
TEST(SolveIncreasing, ConvergesOnFlatParts) {
  const auto step = [](double x) { return ValueWithDerivative{std::atan(50 * x), 50 / (1 + 2500 * x * x)}; };
  EXPECT_NEAR(*solve_increasing(step, std::atan(0.5), -10, 10, 9.0), 0.01, 1e-12);
}

}  // namespace
}  // namespace spartan::internal
