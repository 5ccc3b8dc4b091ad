// Registration of a local map to the global map: search, refinement, acceptance tests.
#pragma once

#include <span>
#include <string_view>

#include "spartan/core/pose.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/local_map.h"
#include "spartan/reconstruction/map_generator.h"
#include "spartan/slam/global_map.h"
#include "spartan/slam/slam_options.h"

namespace spartan {

/// Whether a match is accepted, or the reason why not.
enum class MatchStatus {
  decided,        ///< Accepted: all six degrees of freedom are determined.
  no_overlap,     ///< The maps overlap too little.
  flat,           ///< The terrain does not determine all six degrees of freedom.
  ambiguous,      ///< Another pose fits nearly as well.
  high_residual,  ///< The residuals are larger than the maps' variances allow ("misfit" in files).
  at_edge,        ///< The best pose lies outside of the search window.
};
std::string_view name_of(MatchStatus status);

struct MapMatch {
  MatchStatus status = MatchStatus::no_overlap;
  Pose world_from_body;  ///< The best pose found; the prior pose where there is none.
  /// Inverse covariance of its right perturbation relative to the global map. Zero where the match is not accepted; for
  /// `flat` it has the rank of the determined directions.
  Matrix6d information = Matrix6d::Zero();
  double overlap = 0;              ///< Fraction of the local map's cells that the global map has observed.
  int cells = 0, blocks = 0;       ///< Overlapping cells, and blocks of them.
  int determined = 0;              ///< Number of determined directions, 0 … 6.
  double normalized_residual = 0;  ///< Normalized residual: median |r| / (0.6745 σ), 1 where the variances are right.
  double sigma_m = 0, sigma_rad = 0;  ///< Largest standard deviations of translation and rotation.
  double margin = 0;   ///< Margin: standard errors by which the next candidate fits worse; infinite without one.
  int candidates = 0;  ///< Number of refined candidates.

  bool decided() const { return status == MatchStatus::decided; }
};

/// Matches the points of a stop to the global map. `local` is the local map of the points at the prior pose
/// `world_from_body`; a cell needs `fewest_points` points. Method: docs/math/map_merging.md.
MapMatch match_map(std::span<const SurfacePoint> points, const LocalMap& local, const MapView& global,
                   const UncertainPose& world_from_body, int min_points, const MatchOptions& options,
                   const ThreadPool& workers);

}  // namespace spartan
