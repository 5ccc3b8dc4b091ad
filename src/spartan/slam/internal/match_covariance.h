// Covariance of a map match, and its cost for the comparison with other candidates.
#pragma once

#include <span>

#include "spartan/slam/internal/map_refinement.h"

namespace spartan::internal {

/// Covariance of a refined match from blocks of cells with independent errors (docs/math/map_merging.md,
/// "Information").
struct MatchCovariance {
  int cells = 0, blocks = 0;
  double normalized_residual =
      0;  ///< Normalized residual: median |residual| / (0.6745 σ), 1 where the variances are right.
  /// Inverse covariance of η = (t, θ) about the centre of the cells' Jacobians, by the block jackknife; zero in
  /// directions that are not determined.
  Matrix6d information = Matrix6d::Zero();
  int determined = 0;                 ///< Number of directions with information.
  double sigma_m = 0, sigma_rad = 0;  ///< Largest standard deviations of translation and rotation; infinite where a
                                      ///< direction has no significant curvature.
};
MatchCovariance estimate_match_covariance(std::span<const MatchedCell> cells, double cell_m,
                                          const MatchOptions& options);

/// Mean robust cost u²/(1 + u²) of the cells, u = residual / (k scale σ), k = robust_sigmas, and its variance from
/// blocks.
struct MatchCost {
  double mean = 1, variance = 0;
};
MatchCost cost_of(std::span<const MatchedCell> cells, double cell_m, double scale, const MatchOptions& options);

}  // namespace spartan::internal
