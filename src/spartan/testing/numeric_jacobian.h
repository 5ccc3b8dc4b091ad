// Derivatives by central differences, as reference for analytic ones.
#pragma once

#include <Eigen/Core>
#include <functional>

namespace spartan::testing {

/// ∂f/∂x at x by central differences with one Richardson step (error of order h⁴).
template <int Out, int In>
Eigen::Matrix<double, Out, In> numeric_jacobian(
    const std::function<Eigen::Matrix<double, Out, 1>(const Eigen::Matrix<double, In, 1>&)>& f,
    const Eigen::Matrix<double, In, 1>& x, double step = 1e-4) {
  Eigen::Matrix<double, Out, In> jacobian;
  const auto difference = [&](int column, double h) -> Eigen::Matrix<double, Out, 1> {
    Eigen::Matrix<double, In, 1> plus = x, minus = x;
    plus[column] += h;
    minus[column] -= h;
    return (f(plus) - f(minus)) / (2 * h);
  };
  for (int column = 0; column < In; ++column) {
    jacobian.col(column) = (4.0 * difference(column, step) - difference(column, 2 * step)) / 3.0;
  }
  return jacobian;
}

}  // namespace spartan::testing
