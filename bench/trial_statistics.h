// Statistics over the trials of a Monte Carlo test.
#pragma once

#include <cmath>
#include <numeric>
#include <vector>

#include "localization_trial.h"

namespace spartan {

struct Mean {
  double mean = 0, half_width = 0;  // of the 95 % confidence interval
};

/// 97.5 % quantile of Student's t with n − 1 degrees of freedom, approximated within 1 % for n ≥ 8 by
/// 1.96 + 2.4 / (n − 1).
inline Mean mean_of(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double squares = 0;
  for (const double v : values) squares += (v - mean) * (v - mean);
  return {mean, n > 1 ? (1.96 + 2.4 / (n - 1)) * std::sqrt(squares / (n - 1) / n) : 0};
}

/// Quantile of the mean of `trials` chi-square variables with `dof` degrees of freedom, by the Wilson-Hilferty
/// approximation (within 0.1 % for dof · trials ≥ 90).
inline double chi_square_mean(double normal_quantile, int dof, int trials) {
  const double k = dof * trials, c = 2.0 / (9.0 * k);
  return dof * std::pow(1 - c + normal_quantile * std::sqrt(c), 3);
}

struct Band {
  double low, high;
  bool contains(double x) const { return x >= low && x <= high; }
};
inline Band band(int dof, int trials) {
  return {chi_square_mean(-1.959964, dof, trials), chi_square_mean(1.959964, dof, trials)};
}

/// Percentage of every fifth frame at which the mean NEES over the trials is inside the band.
inline double percent_in_band(const std::vector<TrialResult>& trials, const Band& b, double FrameError::*nees) {
  int inside = 0, count = 0;
  for (std::size_t i = 0; i < trials[0].frames.size(); i += 5) {
    double sum = 0;
    for (const TrialResult& t : trials) sum += t.frames[i].*nees;
    inside += b.contains(sum / static_cast<double>(trials.size())) ? 1 : 0;
    ++count;
  }
  return 100.0 * inside / count;
}

}  // namespace spartan
