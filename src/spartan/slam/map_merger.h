// Map merging: the published sub-module that turns local maps into one global map and corrects the odometry by it.
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
  MapMatch match;           ///< against the global map of the stop before; `no_overlap` where there was none
  UncertainPose corrected;  ///< world_from_body: the given pose, moved as far as the match says
  /// What the map alone says: none where it could not decide at all, of less than full rank where only some directions
  /// are determined.
  std::optional<PoseConstraint> constraint;
  LocalMap local;  ///< at the corrected pose

  bool decided() const { return match.decided(); }
};

/// The memory is the global map of t−1. Where the match cannot decide, the local map is fused at the given pose, its
/// cells less certain by that pose's covariance. The first stop stands where it is given and is the map's measure.
class MapMerger {
 public:
  MapMerger(const SlamOptions& options, const MapOptions& map_options, const Workers& workers);

  /// The points of one stop, in its body frame. `world_from_body`: where the odometry or the localization believes it
  /// is. Errors are those of the store that tiles are read from; after one nothing has changed.
  Result<MapMergeResult> add(std::span<const SurfacePoint> points, const Stamp& stamp,
                             const UncertainPose& world_from_body);

  GlobalMap& map() { return map_; }

  /// From now on the map's tiles may live in the store, which must hold this map or be empty. Borrowed.
  void page_to(TileStore* store) { map_.page_to(store); }
  /// Writes what has changed into the store, inside the transaction that it is in.
  Status flush() { return map_.flush(); }
  /// What belongs to the flushed tables, versioned.
  Bytes save() const;
  /// The state of `save()` with the tables as they were then. Codes: `store_damaged` where the bytes are damaged or
  /// do not fit the tables, `input` where they are of another version.
  Status restore(const Bytes& bytes, TileStore& store);

 private:
  Matrix6d map_covariance(const MapView& view, const LocalMap& local, const Pose& world_from_body) const;

  SlamOptions options_;
  MapOptions map_options_;
  Workers workers_;
  MapGenerator generator_;
  GlobalMap map_;
};

}  // namespace spartan
