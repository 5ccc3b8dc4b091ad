// Quantiles of the chi-square distribution, for gates.
#pragma once

namespace spartan {

/// P(χ² ≤ x) for k ≥ 1 degrees of freedom, x ≥ 0: the finite sums for even and odd k (Abramowitz & Stegun 26.4.4, 5).
double chi_square_probability(double x, int degrees);

/// The x with that probability, by bisection to 1e-12; 0 < probability < 1.
double chi_square_quantile(double probability, int degrees);

}  // namespace spartan
