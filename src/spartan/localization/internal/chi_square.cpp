#include "spartan/localization/internal/chi_square.h"

#include <cmath>

namespace spartan::internal {

// Q = 1 − P is, for even k, e^{−x/2} Σ_{i<k/2} (x/2)^i / i!; for odd k, erfc(√(x/2)) + e^{−x/2} Σ (x/2)^{i−1/2} /
// Γ(i+1/2).
double chi_square_probability(double x, int degrees) {
  if (!(x > 0)) return 0;
  const double half = 0.5 * x;
  const bool odd = degrees % 2 == 1;
  double sum = odd ? std::erfc(std::sqrt(half)) : 0;
  for (double order = odd ? 0.5 : 0.0; order < 0.5 * degrees; order += 1.0) {
    sum += std::exp(order * std::log(half) - half - std::lgamma(order + 1));
  }
  return 1 - sum;
}

double chi_square_quantile(double probability, int degrees) {
  double low = 0, high = degrees;
  while (chi_square_probability(high, degrees) < probability) high *= 2;
  while (high - low > 1e-12 * high) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) break;
    (chi_square_probability(middle, degrees) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace spartan::internal
