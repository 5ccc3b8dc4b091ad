// Options of map merging and of the global map.
#pragma once

#include <cmath>

#include "spartan/core/options.h"

namespace spartan {

/// How a local map is matched to the global map, and when the match is accepted (docs/math/map_merging.md). The
/// defaults were chosen on simulated drives (docs/notes/map_merging.md).
struct MatchOptions {
  double window_sigmas = 3;            ///< Half size of the search window, standard deviations of the prior pose.
  double max_search_m = 0.5;           ///< Upper bound of the half size of the window along x and y, m.
  double max_search_deg = 8;           ///< Upper bound of the half size of the window in yaw, degrees.
  double step_m = 0.05;                ///< Step of the search along x and y, m.
  double step_deg = 1;                 ///< Step of the search in yaw, degrees.
  double class_weight = 0.2;           ///< Weight of the occupancy term relative to the elevation term.
  double elevation_scale_m = 0.02;     ///< Scale of the robust elevation cost of the search, m.
  int candidates = 8;                  ///< Number of local minima of the search that are refined.
  double relief_sigma_ratio = 0.15;    ///< Standard deviation of a cell's elevation, relative to its relief.
  double robust_sigmas = 3;            ///< Scale of the robust cost of the refinement, standard deviations.
  double block_m = 0.3;                ///< Side of a block of cells whose errors are correlated, m.
  double common_error_ratio = 1.1;     ///< Error common to an area, relative to the residuals' standard deviation.
  double common_error_area_m = 1.5;    ///< Side of an area of common range errors, m.
  double relief_error_ratio = 3;       ///< Fronto-parallel bias, relative to the residuals' standard deviation.
  int min_cells = 200;                 ///< Minimum number of overlapping cells.
  int min_blocks = 12;                 ///< Minimum number of overlapping blocks.
  double max_sigma_m = 0.013;          ///< Largest standard deviation of a determined translation, m.
  double max_sigma_deg = 0.75;         ///< Largest standard deviation of a determined rotation, degrees.
  double min_relief_sigmas = 1.65;     ///< Required significance of the curvature along a direction.
  double min_margin_sigmas = 2.33;     ///< Required margin over the second-best candidate, standard errors.
  double max_normalized_residual = 3;  ///< Largest accepted median of the normalized residuals.

  /// Limit of the search: 32 bytes for each trial, 160 MB.
  static constexpr double kMostTrials = 5e6;
  /// Number of trials of the largest search: shifts along x and y times rotations.
  double trials() const {
    const auto count = [](double widest, double step) { return 2 * std::ceil(widest / step) + 1; };
    return count(max_search_m, step_m) * count(max_search_m, step_m) * count(max_search_deg, step_deg);
  }

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("window_sigmas", window_sigmas,
            "Half size of the search window in standard deviations of the prior pose; raising it tolerates larger "
            "errors of the prior and takes more time.",
            between(1, 10));
    v.renamed("widest_m", "max_search_m");
    v.field(
        "max_search_m", max_search_m,
        "Upper bound of the half size of the search window along x and y in metres; raise it where the odometry may "
        "drift farther between local maps.",
        between(0.05, 10));
    v.renamed("widest_deg", "max_search_deg");
    v.field(
        "max_search_deg", max_search_deg,
        "Upper bound of the half size of the search window in yaw, in degrees; raise it where the heading may drift "
        "more between local maps.",
        between(0.5, 60));
    v.field(
        "step_m", step_m,
        "Step of the search along x and y in metres; raising it is faster, but may miss the basin of convergence of "
        "the refinement.",
        between(0.005, 1));
    v.field("step_deg", step_deg,
            "Step of the search in yaw, in degrees; raising it is faster, but may miss the basin of convergence of the "
            "refinement.",
            between(0.05, 10));
    v.field("class_weight", class_weight,
            "Weight of disagreeing occupancy relative to disagreeing elevations in the cost of the search; raising it "
            "gives obstacles and cavities more influence.",
            between(0, 10));
    v.renamed("blur_m", "elevation_scale_m");
    v.field("elevation_scale_m", elevation_scale_m,
            "Scale of the robust elevation cost of the search in metres, at which a difference has half of the maximum "
            "cost, and initial inflation of the residuals' standard deviation in the refinement; raising it widens the "
            "basin of convergence.",
            between(0.001, 1));
    v.renamed("peaks", "candidates");
    v.field("candidates", candidates,
            "Number of local minima of the search, best first, that are refined; raising it finds more alternative "
            "poses on "
            "repetitive terrain and takes more time.",
            between(1, 100));
    v.renamed("relief_sigma", "relief_sigma_ratio");
    v.field("relief_sigma_ratio", relief_sigma_ratio,
            "Standard deviation of a cell's elevation relative to its relief (highest minus lowest point); raising it "
            "gives rough cells less weight.",
            between(0, 1));
    v.field("robust_sigmas", robust_sigmas,
            "Scale of the Geman-McClure cost of the refinement in standard deviations: a residual that large has a "
            "quarter of the full weight; raising it increases the influence of outliers.",
            between(0.5, 20));
    v.field("block_m", block_m,
            "Side in metres of the blocks of the jackknife, within which errors of cells are correlated; raising it "
            "gives larger covariances.",
            between(0.05, 10));
    v.renamed("common_share", "common_error_ratio");
    v.field(
        "common_error_ratio", common_error_ratio,
        "Range error that all cells of an area have in common, relative to the standard deviation of the residuals; "
        "raising it gives larger covariances, above all on smooth terrain.",
        between(0, 10));
    v.renamed("common_reach_m", "common_error_area_m");
    v.field("common_error_area_m", common_error_area_m,
            "Side in metres of the areas whose cells have a common range error; raising it gives larger covariances.",
            between(0.1, 100));
    v.renamed("relief_share", "relief_error_ratio");
    v.field("relief_error_ratio", relief_error_ratio,
            "Error that all relief of a view has in common because of the fronto-parallel bias of the stereo matching, "
            "relative to the standard deviation of the residuals; raising it gives larger covariances.",
            between(0, 10));
    v.renamed("fewest_cells", "min_cells");
    v.field("min_cells", min_cells,
            "Minimum number of cells that both maps have observed; raising it rejects matches of small overlap.",
            between(20, 1e6));
    v.renamed("fewest_blocks", "min_blocks");
    v.field("min_blocks", min_blocks,
            "Minimum number of blocks (see block_m) that both maps have observed; raising it rejects matches "
            "of small "
            "overlap.",
            between(8, 1e4));
    v.renamed("largest_sigma_m", "max_sigma_m");
    v.field("max_sigma_m", max_sigma_m,
            "Largest standard deviation in metres of a translation that counts as determined; raising it accepts less "
            "certain matches.",
            between(0.0001, 10));
    v.renamed("largest_sigma_deg", "max_sigma_deg");
    v.field("max_sigma_deg", max_sigma_deg,
            "Largest standard deviation in degrees of a rotation that counts as determined; raising it accepts less "
            "certain matches.",
            between(0.001, 45));
    v.renamed("relief_certainty", "min_relief_sigmas");
    v.field("min_relief_sigmas", min_relief_sigmas,
            "Required significance of the cost's curvature along a direction, in standard errors (1.65: 5 %, "
            "one-sided); raising it declares more directions undetermined on flat terrain.",
            between(0, 20));
    v.renamed("lead_certainty", "min_margin_sigmas");
    v.field(
        "min_margin_sigmas", min_margin_sigmas,
        "Required difference between the costs of the best and the second-best candidate, in standard errors (2.33: "
        "1 %, one-sided); raising it declares more matches ambiguous.",
        between(1, 20));
    v.renamed("largest_misfit", "max_normalized_residual");
    v.field(
        "max_normalized_residual", max_normalized_residual,
        "Largest accepted normalized MAD of the residuals over their standard deviations (1 for Gaussian residuals); "
        " raising it accepts matches that fit worse.",
        between(1, 100));
    v.check(
        "step_m", trials() <= kMostTrials,
        "is too small for max_search_m: (2 max_search_m / step_m + 1)^2 shifts times (2 max_search_deg / step_deg + 1) "
        "rotations "
        "exceed 5 million trials");
  }
};

struct GlobalMapOptions {
  double submap_m = 12;              ///< Distance from the last submap's anchor at which a new submap begins, m.
  int memory_mb = 256;               ///< Memory limit of cached tiles, 10⁶ bytes.
  double gate_sigmas = 3;            ///< Gate on elevation differences, standard deviations.
  double relief_sigma_ratio = 0.15;  ///< Standard deviation of a cell's elevation, relative to its relief.
  double min_sigma_m = 0.002;        ///< Lower bound of a cell's standard deviation, m.

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("submap_m", submap_m,
            "Distance in metres from the anchor of the last submap at which a new one begins; raising it makes fewer, "
            "larger submaps.",
            between(1, 10000));
    v.field("memory_mb", memory_mb,
            "Memory limit of the tiles of the global map in megabytes; tiles beyond it are kept in the run's database "
            "(run.sqlite) only, so raising it saves reads.",
            between(1, 1e6));
    v.field("gate_sigmas", gate_sigmas,
            "Gate on the difference between an observed elevation and that of its cell, in standard "
            "deviations; raising "
            "it fuses observations that contradict more.",
            between(1, 20));
    v.renamed("relief_sigma", "relief_sigma_ratio");
    v.field("relief_sigma_ratio", relief_sigma_ratio,
            "Standard deviation that a cell's relief (highest minus lowest point) adds to the gate, relative to that "
            "relief; raising it fuses rough cells more readily.",
            between(0, 1));
    v.renamed("least_sigma_m", "min_sigma_m");
    v.field("min_sigma_m", min_sigma_m,
            "Lower bound of the standard deviation of a fused elevation in metres; raising it lets later "
            "observations change fused cells more.",
            between(1e-5, 1));
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
