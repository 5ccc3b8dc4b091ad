#include "spartan/odometry/internal/matching/projected_jacobian.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <vector>

#include "spartan/numerics/random.h"
#include "spartan/odometry/internal/each_target_test.h"

namespace spartan::internal {
namespace {

/// A value of each pixel, row by row.
using Function = Eigen::VectorXd;

Function function_of(const std::function<double(int, int)>& value) {
  Function f(kWindowArea);
  for (int k = 0; k < kWindowArea; ++k) f[k] = value(k % kWindowSide - kWindowRadius, k / kWindowSide - kWindowRadius);
  return f;
}

Function function_of(const Window& window) {
  return function_of([&](int i, int j) {
    const auto row = static_cast<std::size_t>((j + kWindowRadius) * kWindowStride);
    return window.values[row + static_cast<std::size_t>(i + kWindowRadius)];
  });
}

Window window_of(const Function& f) {
  Window window;
  for (int k = 0; k < kWindowArea; ++k) {
    window.values[static_cast<std::size_t>(k / kWindowSide * kWindowStride + k % kWindowSide)] =
        static_cast<float>(f[k]);
  }
  return window;
}

Function offset_x() {
  return function_of([](int i, int) { return i; });
}
Function offset_y() {
  return function_of([](int, int j) { return j; });
}

/// A template of noise, whose derivatives contain planes.
WindowGradients noise_template() {
  Random random(3);
  const auto noise = [&] { return function_of([&](int, int) { return 20 * random.normal(); }); };
  WindowGradients g;
  g.value = window_of(noise());
  subtract_mean(g.value);
  g.along_x = window_of(Function(noise().array() + 5) + 2 * offset_x());
  g.along_y = window_of(Function(noise().array() - 9) - 3 * offset_y());
  return g;
}

struct Functions {
  std::vector<Function> nuisance, columns;
};

Functions functions_of(const WindowGradients& g, AlignmentUnknowns unknowns) {
  const Function t = function_of(g.value), x = function_of(g.along_x), y = function_of(g.along_y);
  const Function by_scale = offset_x().cwiseProduct(x) + offset_y().cwiseProduct(y);
  Functions f{{Function::Ones(kWindowArea), offset_x(), offset_y(), t}, {}};
  switch (unknowns) {
    case AlignmentUnknowns::position:
      f.nuisance.push_back(by_scale);
      f.columns = {x, y};
      break;
    case AlignmentUnknowns::disparity_and_slant:
      f.columns = {-x, -offset_x().cwiseProduct(x), -offset_y().cwiseProduct(x)};
      break;
    case AlignmentUnknowns::position_and_slant:
      f.columns = {x, y, -offset_x().cwiseProduct(x), -offset_y().cwiseProduct(x)};
      break;
  }
  return f;
}

Eigen::MatrixXd matrix_of(const std::vector<Function>& columns) {
  Eigen::MatrixXd matrix(kWindowArea, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t a = 0; a < columns.size(); ++a) matrix.col(static_cast<Eigen::Index>(a)) = columns[a];
  return matrix;
}

/// Compares with the projection by weighted least squares in double precision.
void expect_projected(const WindowGradients& g, AlignmentUnknowns unknowns, double tolerance) {
  const Functions f = functions_of(g, unknowns);
  const Function weights = function_of(window_weights());
  const Function root = weights.cwiseSqrt();
  const Eigen::MatrixXd n = root.asDiagonal() * matrix_of(f.nuisance), j = root.asDiagonal() * matrix_of(f.columns);
  auto solver = n.completeOrthogonalDecomposition();
  solver.setThreshold(1e-4);
  const Eigen::MatrixXd projected = j - n * solver.solve(j);
  const Eigen::MatrixXd information = projected.transpose() * projected;

  const ProjectedJacobian found(g, unknowns);
  const Function t = weights.cwiseProduct(function_of(g.value));
  EXPECT_LT((function_of(found.factors[0]) - t).norm(), 1e-5 * t.norm());
  for (Eigen::Index a = 0; a < j.cols(); ++a) {
    const Window& factor = found.factors[static_cast<std::size_t>(a) + 1];
    EXPECT_LT((function_of(factor) - root.cwiseProduct(projected.col(a))).norm(), tolerance * j.col(a).norm()) << a;
    for (int row = 0; row < kWindowSide; ++row)
      EXPECT_EQ(factor.values[static_cast<std::size_t>(row * kWindowStride + kWindowSide)], 0);
    for (Eigen::Index b = 0; b < j.cols(); ++b)
      EXPECT_NEAR(found.information(a, b), information(a, b), tolerance * j.col(a).norm() * j.col(b).norm());
  }
}

TEST(ProjectedJacobian, IsOrthogonalToTheNuisance) {
  const WindowGradients g = noise_template();
  with_each_target([&] {
    for (const auto unknowns :
         {AlignmentUnknowns::position, AlignmentUnknowns::disparity_and_slant, AlignmentUnknowns::position_and_slant})
      expect_projected(g, unknowns, 2e-6);
  });
}

// The derivative of a parabola by its scale is a multiple of it, and the derivatives by the position are planes.
TEST(ProjectedJacobian, DependentNuisanceIsRemovedOnce) {
  WindowGradients g;
  g.value = window_of(Function(offset_x().array().square() + offset_y().array().square()));
  subtract_mean(g.value);
  g.along_x = window_of(2 * offset_x());
  g.along_y = window_of(2 * offset_y());
  with_each_target([&] {
    expect_projected(g, AlignmentUnknowns::position, 2e-6);
    expect_projected(g, AlignmentUnknowns::disparity_and_slant, 2e-6);
  });
}

}  // namespace
}  // namespace spartan::internal
