// Visual SLAM by map merging: matching of local maps with the global map, and their fusion.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/threads.h"
#include "spartan/core/time.h"
#include "spartan/core/trajectory.h"
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
  /// `flat` it has the rank of the determined directions, or is zero where it would move the pose in the others.
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
/// `world_from_body`; a cell needs `min_points` points. Method: docs/math/map_merging.md.
MapMatch match_map(std::span<const SurfacePoint> points, const LocalMap& local, const MapView& global,
                   const UncertainPose& world_from_body, int min_points, const MatchOptions& options,
                   const ThreadPool& workers);

/// What a local map told about the pose.
struct MapMergeResult {
  MapMatch match;           ///< Relative to the global map of the previous stops; `no_overlap` where there was none.
  UncertainPose corrected;  ///< world_from_body: the prior pose updated by the match.
  /// The constraint of the match alone: none where it was rejected, of less than full rank where only some directions
  /// are determined.
  std::optional<PoseConstraint> constraint;
  LocalMap local;  ///< At the corrected pose.
  Stamp stamp;
  /// Covariance of the corrected pose relative to the global map (right perturbation).
  Matrix6d relative_covariance = Matrix6d::Zero();

  bool decided() const { return match.decided(); }
};

/// A part of the global map, and the stops that made it.
struct MapExcerpt {
  MapView view;
  std::vector<MapStop> stops;
};

/// Its state is the global map of the stops up to t−1. Where the match is rejected, the local map is fused at the prior
/// pose, and the variances of its cells are inflated by that pose's covariance. The first stop keeps its prior pose and
/// defines the map frame. Derivation: docs/math/map_merging.md.
class MapMerger {
 public:
  /// Code `configuration` where an option is out of bounds.
  static Result<MapMerger> create(const SlamOptions& options, const MapOptions& map_options, const ThreadPool& workers);

  /// Adds the points of one stop, in its body frame. `world_from_body`: prior pose of the odometry or the localization.
  /// Errors are those of the store that tiles are read from; after one nothing has changed.
  Result<MapMergeResult> add(std::span<const SurfacePoint> points, const Stamp& stamp,
                             const UncertainPose& world_from_body);

  /// The steps of add(). What match() needs of the global map: none where that is empty. Codes as add().
  Result<std::optional<MapExcerpt>> excerpt_around(const Pose& world_from_body);
  /// Uses nothing that the other functions change, so it may run beside them. `workers`: for its loops.
  MapMergeResult match(std::span<const SurfacePoint> points, const Stamp& stamp, const UncertainPose& world_from_body,
                       const std::optional<MapExcerpt>& global, const ThreadPool& workers) const;
  /// Adds a matched local map to the global map. Codes as add(); after an error nothing has changed.
  Status fuse(const MapMergeResult& matched);

  GlobalMap& map() { return map_; }

  /// From now on tiles of the map may be paged out to the store, which must contain this map or be empty. Borrowed.
  void page_to(TileStore* store) { map_.page_to(store); }
  /// Writes all changes to the store, inside its current transaction.
  Status flush() { return map_.flush(); }
  /// As GlobalMap::take_changes() and GlobalMap::changes_stored().
  MapChanges take_changes() { return map_.take_changes(); }
  void changes_stored(std::uint64_t number) { map_.changes_stored(number); }
  /// The state that belongs to the flushed tables, versioned.
  Bytes save() const;
  /// Restores the state of `save()` with the tables of that moment. Codes: `store_damaged` where the bytes
  /// are damaged or do not fit the tables, `configuration` where they are of another version.
  Status restore(const Bytes& bytes, TileStore& store);

 private:
  MapMerger(const SlamOptions& options, const MapOptions& map_options, GlobalMap map, const ThreadPool& workers);

  SlamOptions options_;
  MapOptions map_options_;
  ThreadPool workers_;
  GlobalMap map_;
};

}  // namespace spartan
