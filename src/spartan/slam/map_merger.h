// Map merging: fuses local maps into one global map and corrects the pose of the odometry by map matching.
#pragma once

#include <optional>
#include <span>

#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/pose_constraint.h"
#include "spartan/core/threads.h"
#include "spartan/core/time.h"
#include "spartan/reconstruction/map_generator.h"
#include "spartan/slam/global_map.h"
#include "spartan/slam/map_matcher.h"
#include "spartan/slam/slam_options.h"

namespace spartan {

struct MapMergeResult {
  MapMatch match;           ///< Relative to the global map of the previous stops; `no_overlap` where there was none.
  UncertainPose corrected;  ///< world_from_body: the prior pose updated by the match.
  /// The constraint of the match alone: none where it was rejected, of less than full rank where only some directions
  /// are determined.
  std::optional<PoseConstraint> constraint;
  LocalMap local;  ///< At the corrected pose.

  bool decided() const { return match.decided(); }
};

/// Its state is the global map of the stops up to t−1. Where the match is rejected, the local map is fused at the prior
/// pose, and the variances of its cells are inflated by that pose's covariance. The first stop keeps its prior pose and
/// defines the map frame. Derivation: docs/math/map_merging.md.
class MapMerger {
 public:
  MapMerger(const SlamOptions& options, const MapOptions& map_options, const ThreadPool& workers);

  /// Adds the points of one stop, in its body frame. `world_from_body`: prior pose of the odometry or the localization.
  /// Errors are those of the store that tiles are read from; after one nothing has changed.
  Result<MapMergeResult> add(std::span<const SurfacePoint> points, const Stamp& stamp,
                             const UncertainPose& world_from_body);

  GlobalMap& map() { return map_; }

  /// From now on tiles of the map may be paged out to the store, which must contain this map or be empty. Borrowed.
  void page_to(TileStore* store) { map_.page_to(store); }
  /// Writes all changes to the store, inside its current transaction.
  Status flush() { return map_.flush(); }
  /// The state that belongs to the flushed tables, versioned.
  Bytes save() const;
  /// Restores the state of `save()` with the tables of that moment. Codes: `store_damaged` where the bytes
  /// are damaged or do not fit the tables, `input` where they are of another version.
  Status restore(const Bytes& bytes, TileStore& store);

 private:
  Matrix6d map_covariance(const MapView& view, const LocalMap& local, const Pose& world_from_body) const;

  SlamOptions options_;
  MapOptions map_options_;
  ThreadPool workers_;
  MapGenerator generator_;
  GlobalMap map_;
};

}  // namespace spartan
