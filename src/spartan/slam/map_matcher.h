// Where a local map lies in the global one: search, refinement, decision.
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

/// Why a place is believed or not.
enum class MatchVerdict {
  decided,
  no_overlap,  ///< too little ground that both maps know
  flat,        ///< the ground does not determine all six directions
  ambiguous,   ///< another place fits nearly as well
  misfit,      ///< the residuals are larger than the maps' variances allow
  at_edge,     ///< the best place lies at the edge of what was searched
};
std::string_view name_of(MatchVerdict verdict);

struct MapMatch {
  MatchVerdict verdict = MatchVerdict::no_overlap;
  Pose world_from_body;  ///< the best place found; the given one where there is none
  /// Of its right perturbation, against the global map as it stands: zero where not decided, but for `flat`, where the
  /// determined directions have theirs.
  Matrix6d information = Matrix6d::Zero();
  double overlap = 0;  ///< share of the local map's cells that the global map knows
  int cells = 0, blocks = 0, determined = 0;
  double misfit = 0;                  ///< of the residuals over what the variances say
  double sigma_m = 0, sigma_rad = 0;  ///< largest standard deviations of place and attitude
  double lead = 0;                    ///< sigmas by which the next best place fits worse; infinite where there is none
  int candidates = 0;

  bool decided() const { return verdict == MatchVerdict::decided; }
};

/// Method: docs/math/map_merging.md. `local` is the map of the points at the given pose.
MapMatch match_map(std::span<const SurfacePoint> points, const LocalMap& local, const MapView& global,
                   const UncertainPose& world_from_body, int fewest_points, const MatchOptions& options,
                   const Workers& workers);

}  // namespace spartan
