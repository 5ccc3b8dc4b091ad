// Polynomials of one variable, and functions that grow: what the radial maps of camera models are made of.
// Internal to rig.
#pragma once

#include <cmath>
#include <optional>
#include <vector>

namespace spartan::rig_detail {

/// Coefficients from the constant term upwards.
using Polynomial = std::vector<double>;

double value(const Polynomial& p, double s);
Polynomial derivative(const Polynomial& p);
Polynomial product(const Polynomial& a, const Polynomial& b);

/// The places in (low, high) where p changes its sign, ascending; a root that only touches zero does not count.
std::vector<double> sign_changes(Polynomial p, double low, double high);

/// A value with its derivative.
struct Slope {
  double value = 0, slope = 0;
};

/// The x in [low, high] where f(x), a `Slope` growing from low to high, is `target`, to the last digits: Newton's
/// method, with bisection where a step leaves what is left of the interval. None where the target is out of reach.
/// `high` may be infinite; the search then doubles from `start` on.
template <class Function>
std::optional<double> solve_increasing(const Function& f, double target, double low, double high, double start) {
  if (!(f(low).value <= target)) return std::nullopt;
  if (std::isinf(high)) {
    constexpr double kFarthest = 1e12;
    for (high = std::fmax(start, low + 1); high < kFarthest && f(high).value < target;) high *= 2;
  }
  if (!(f(high).value >= target)) return std::nullopt;
  double x = start > low && start < high ? start : 0.5 * (low + high);
  for (int i = 0; i < 200; ++i) {
    const Slope at = f(x);
    (at.value < target ? low : high) = x;
    const double newton = x + (target - at.value) / at.slope;
    const double next = newton >= low && newton <= high ? newton : 0.5 * (low + high);
    if (next == x || high - low <= 1e-16 * std::fabs(high)) break;
    const bool settled = std::fabs(next - x) <= 1e-15 * std::fabs(next);
    x = next;
    if (settled) break;
  }
  return x;
}

}  // namespace spartan::rig_detail
