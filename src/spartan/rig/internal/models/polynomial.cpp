#include "spartan/rig/internal/models/polynomial.h"

#include <cstddef>

namespace spartan::internal {

double value(const Polynomial& p, double s) {
  double sum = 0;
  for (std::size_t i = p.size(); i-- > 0;) sum = sum * s + p[i];
  return sum;
}

Polynomial derivative(const Polynomial& p) {
  Polynomial d;
  d.reserve(p.size());
  for (std::size_t i = 1; i < p.size(); ++i) d.push_back(static_cast<double>(i) * p[i]);
  return d;
}

Polynomial product(const Polynomial& a, const Polynomial& b) {
  Polynomial result(a.size() + b.size() - 1, 0.0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) result[i + j] += a[i] * b[j];
  }
  return result;
}

// Between neighbouring sign changes of p' the polynomial is monotonic, so bisection finds every sign change of p.
std::vector<double> sign_changes(Polynomial p, double low, double high) {
  while (!p.empty() && p.back() == 0) p.pop_back();
  if (p.size() < 2) return {};
  std::vector<double> borders = sign_changes(derivative(p), low, high);
  borders.push_back(high);
  std::vector<double> roots;
  for (double left = low; const double right : borders) {
    const bool rises = value(p, left) < 0;
    if (rises == (value(p, right) < 0)) {
      left = right;
      continue;
    }
    double a = left, b = right;
    for (double middle = 0.5 * (a + b); middle > a && middle < b; middle = 0.5 * (a + b)) {
      ((value(p, middle) < 0) == rises ? a : b) = middle;
    }
    roots.push_back(a);
    left = right;
  }
  return roots;
}

}  // namespace spartan::internal
