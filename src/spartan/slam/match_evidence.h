// What speaks for a match: how certain it is, direction by direction, and how far ahead of another one.
#pragma once

#include <span>

#include "spartan/slam/map_refinement.h"

namespace spartan {

/// Of a refined match, from blocks of cells that err on their own (docs/math/map_merging.md, "Information").
struct MatchEvidence {
  int cells = 0, blocks = 0;
  double misfit = 0;  ///< median |residual| / (0.6745 σ): 1 where the variances say the truth
  /// Inverse covariance of η = (t, θ) about the centre that the cells were made with, by the block jackknife; zero in
  /// directions that are not determined.
  Matrix6d information = Matrix6d::Zero();
  int determined = 0;                 ///< directions with information
  double sigma_m = 0, sigma_rad = 0;  ///< largest standard deviations of place and attitude, believed or not
};
MatchEvidence weigh(std::span<const MatchedCell> cells, double cell_m, const MatchOptions& options);

/// Mean robust cost u²/(1 + u²) of the cells, u = residual / (k scale σ), and its variance by blocks.
struct MatchCost {
  double mean = 1, variance = 0;
};
MatchCost cost_of(std::span<const MatchedCell> cells, double cell_m, double scale, const MatchOptions& options);

}  // namespace spartan
