// Polynomials of one variable and inversion of monotonic functions, for the radial maps of camera models.
// Internal to rig.
#pragma once

#include <cmath>
#include <optional>
#include <vector>

namespace spartan::internal {

/// Coefficients in ascending order, beginning with the constant term.
using Polynomial = std::vector<double>;

double value(const Polynomial& p, double s);
Polynomial derivative(const Polynomial& p);
Polynomial product(const Polynomial& a, const Polynomial& b);

/// The roots in (low, high) at which p changes its sign, ascending; roots of even multiplicity are omitted.
std::vector<double> sign_changes(Polynomial p, double low, double high);

/// The value of a function and its derivative.
struct ValueWithDerivative {
  double value = 0, derivative = 0;
};

/// Solves f(x) = `target` on [low, high] to machine precision, where f returns a ValueWithDerivative and increases:
/// Newton's method, safeguarded by bisection if a step leaves the bracket. nullopt if the target is outside of
/// [f(low), f(high)]. `high` may be infinite; then the upper end is found by doubling, beginning at `start`.
template <class Function>
std::optional<double> solve_increasing(const Function& f, double target, double low, double high, double start) {
  if (!(f(low).value <= target)) return std::nullopt;
  if (std::isinf(high)) {
    constexpr double kFarthest = 1e12;  // end of the doubling
    for (high = std::fmax(start, low + 1); high < kFarthest && f(high).value < target;) high *= 2;
  }
  if (!(f(high).value >= target)) return std::nullopt;
  double x = start > low && start < high ? start : 0.5 * (low + high);
  for (int i = 0; i < 200; ++i) {  // bisection alone needs about 100 steps
    const ValueWithDerivative at = f(x);
    (at.value < target ? low : high) = x;
    const double newton = x + (target - at.value) / at.derivative;
    const double next = newton >= low && newton <= high ? newton : 0.5 * (low + high);
    if (next == x || high - low <= 1e-16 * std::fabs(high)) break;
    const bool converged = std::fabs(next - x) <= 1e-15 * std::fabs(next);
    x = next;
    if (converged) break;
  }
  return x;
}

}  // namespace spartan::internal
