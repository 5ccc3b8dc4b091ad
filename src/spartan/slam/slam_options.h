// Options of map merging and of the global map.
#pragma once

#include <cmath>

#include "spartan/core/options.h"

namespace spartan {

/// How a local map is looked for in the global one, and when the answer is believed (docs/math/map_merging.md).
struct MatchOptions {
  double window_sigmas = 3;
  double widest_m = 0.5;
  double widest_deg = 8;
  double step_m = 0.05;
  double step_deg = 1;
  double class_weight = 0.2;
  double blur_m = 0.02;
  int peaks = 8;
  double relief_sigma = 0.15;
  double robust_sigmas = 3;
  double block_m = 0.3;
  double common_share = 1.1;
  double common_reach_m = 1.5;
  double relief_share = 1;
  int fewest_cells = 200;
  int fewest_blocks = 12;
  double largest_sigma_m = 0.013;
  double largest_sigma_deg = 0.75;
  double relief_certainty = 1.65;
  double lead_certainty = 2.33;
  double largest_misfit = 3;

  /// The search holds 32 bytes for each trial: 160 MB.
  static constexpr double kMostTrials = 5e6;
  /// Of the largest search: shifts along x and y times rotations.
  double trials() const {
    const auto count = [](double widest, double step) { return 2 * std::ceil(widest / step) + 1; };
    return count(widest_m, step_m) * count(widest_m, step_m) * count(widest_deg, step_deg);
  }

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("window_sigmas", window_sigmas, "of the given pose that are searched to each side", between(1, 10));
    v.field("widest_m", widest_m, "nothing is searched farther off", between(0.05, 10));
    v.field("widest_deg", widest_deg, "nor turned farther", between(0.5, 60));
    v.field("step_m", step_m, "of the search", between(0.005, 1));
    v.field("step_deg", step_deg, "of the search", between(0.05, 10));
    v.field("class_weight", class_weight, "of disagreeing classes against disagreeing elevations", between(0, 10));
    v.field("blur_m", blur_m, "elevations so much apart count half in the search", between(0.001, 1));
    v.field("peaks", peaks, "best places of the search that are refined", between(1, 100));
    v.field("relief_sigma", relief_sigma, "uncertainty of a cell's elevation over its own relief", between(0, 1));
    v.field("robust_sigmas", robust_sigmas, "residuals so large count a quarter", between(0.5, 20));
    v.field("block_m", block_m, "cells farther apart err on their own", between(0.05, 10));
    v.field("common_share", common_share, "error that surroundings have in common, over the residuals' own",
            between(0, 10));
    v.field("common_reach_m", common_reach_m, "how far those reach", between(0.1, 100));
    v.field("relief_share", relief_share, "error that all relief of a view has in common, over the residuals' own",
            between(0, 10));
    v.field("fewest_cells", fewest_cells, "that both maps must know", between(20, 1e6));
    v.field("fewest_blocks", fewest_blocks, "of ground that both maps must know", between(8, 1e4));
    v.field("largest_sigma_m", largest_sigma_m, "of the place found, else it is not believed", between(0.0001, 10));
    v.field("largest_sigma_deg", largest_sigma_deg, "of the attitude found, else it is not believed",
            between(0.001, 45));
    v.field("relief_certainty", relief_certainty, "sigmas that a direction's relief stands over chance",
            between(0, 20));
    v.field("lead_certainty", lead_certainty, "sigmas that the best place fits better than the next", between(1, 20));
    v.field("largest_misfit", largest_misfit, "of the residuals over what the variances say", between(1, 100));
    v.check(
        "step_m", trials() <= kMostTrials,
        "is too small for widest_m: (2 widest_m / step_m + 1)^2 shifts times (2 widest_deg / step_deg + 1) rotations "
        "exceed 5 million trials");
  }
};

struct GlobalMapOptions {
  double submap_m = 12;
  int memory_mb = 256;
  double gate_sigmas = 3;
  double relief_sigma = 0.15;
  double least_sigma_m = 0.002;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("submap_m", submap_m, "a new submap begins so far from the last one's anchor", between(1, 10000));
    v.field("memory_mb", memory_mb, "tiles beyond it are kept in the run's store only", between(1, 1e6));
    v.field("gate_sigmas", gate_sigmas, "an elevation farther off contradicts its cell", between(1, 20));
    v.field("relief_sigma", relief_sigma, "what a cell's own relief adds to the gate, over that relief", between(0, 1));
    v.field("least_sigma_m", least_sigma_m, "no cell is known better", between(1e-5, 1));
  }
};

struct SlamOptions {
  MatchOptions match;
  GlobalMapOptions map;

  template <class Visitor>
  void describe(Visitor& v) {
    v.group("match", match);
    v.group("map", map);
  }
};

}  // namespace spartan
