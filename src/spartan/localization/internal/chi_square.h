// Quantiles of the chi-square distribution, for gating.
#pragma once

namespace spartan::internal {

/// P(χ² ≤ x) for k ≥ 1 degrees of freedom, x ≥ 0: the finite sums for even and odd k (Abramowitz & Stegun 26.4.4, 5).
double chi_square_probability(double x, int degrees);

/// The x with P(χ² ≤ x) = probability, by bisection to a relative error of 1e-12; 0 < probability < 1.
double chi_square_quantile(double probability, int degrees);

}  // namespace spartan::internal
