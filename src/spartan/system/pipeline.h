// The whole system as one object that samples are pushed into.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "spartan/camera/frame_source.h"
#include "spartan/camera/samples.h"
#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/stage_clock.h"
#include "spartan/core/threads.h"
#include "spartan/imaging/rectified_pair.h"
#include "spartan/localization/localizer.h"
#include "spartan/odometry/odometer.h"
#include "spartan/rig/rig.h"
#include "spartan/slam/map_merger.h"
#include "spartan/system/run_options.h"

namespace spartan {

/// The ground as seen from one place. The views borrow the pipeline's buffers until the next frame.
struct TerrainView {
  RectifiedPair pair;
  ImageView<const float> disparity;  ///< px, NaN unknown
  Pose world_from_left;              ///< rectified left optical frame
};

/// What a position became when the rover left it.
struct MappedPosition {
  std::int64_t position_id = -1;
  Stamp stamp;  ///< of the shot of the odometry's pair there
  int views = 0;
  UncertainPose believed;  ///< world_from_body before the map was looked for in the global one
  MapMergeResult merged;   ///< where it lies there, and the local map at that place
};

/// What one stereo shot told. `slam`, `localization`, terrain and position are absent in a run by odometry alone
/// (RunOptions::odometry_only).
struct FrameResult {
  std::int64_t frame_id = 0;
  std::string pair;
  Stamp stamp;
  UncertainPose world_from_body;  ///< by odometry alone; the covariance tells of its lasting errors too
  MotionEstimate motion;
  std::optional<UncertainPose> slam;                 ///< world_from_body: odometry, corrected by the map
  std::optional<LocalizationEstimate> localization;  ///< by all sensors
  std::optional<TerrainView> terrain;                ///< where one was due
  std::optional<MappedPosition> position;            ///< the one that was left for this shot
  std::vector<StageTime> times;
};

/// Samples in, poses and terrain out. Used by `spartan run` over a recording; a live camera or a ROS node pushes in
/// the same way, over memory it owns. Not thread-safe; one pipeline per rover.
class Pipeline {
 public:
  /// Codes: `configuration` (rig or options that do not fit; names every option that is out of its bounds).
  /// Self-masks are looked up in `mask_folder` (where the rig file lies).
  static Result<Pipeline> create(const Rig& rig, const RunOptions& options, ThreadPool workers,
                                 const std::string& mask_folder = {});
  Pipeline(Pipeline&&) noexcept;
  Pipeline& operator=(Pipeline&&) noexcept;
  ~Pipeline();

  /// Samples of a rover that surely rests, where they cannot be added before the first frame: they say where up is if
  /// no other sample does.
  void level(std::span<const ImuSample> at_rest);

  /// Those that come before the first frame level the world and tell where east is.
  void add(const ImuSample& sample);
  void add(const WheelSample& sample);
  void add(const CompassSample& sample);
  void add(const InclinometerSample& sample);

  /// One shot. Those of pairs that do not drive the odometry give nothing by themselves: they are views of the position
  /// whose id they carry, which becomes a map when the odometry's pair reports another position. After an error nothing
  /// has advanced, as if the shot had never been: the pipeline may go on with the next one, or get this one again.
  /// Codes: `frame_rejected` where the images do not fit the rig, or it has no such pair; those of the store that tiles
  /// of the map are read from (`store_damaged`).
  Result<std::optional<FrameResult>> add(const StereoFrame& frame);

  /// The global map's tiles may live in the store from now on; what has changed is written by flush_maps(), inside the
  /// transaction that the store's database is in. Borrowed; it holds this pipeline's map or none.
  void page_maps_to(TileStore& store);
  Status flush_maps();
  GlobalMap& global_map();

  /// The position at hand, where it is a map already: at the end of a drive. After an error it stays at hand.
  Result<std::optional<MappedPosition>> leave_position();

  /// What took its time since the last result: views of a position, leaving it.
  std::vector<StageTime> take_times();

  /// After restore(): the shots of the position at hand that must be looked at again before the next is added, and the
  /// way to hand them in, one after the other.
  std::vector<FrameKey> wanted_shots() const;
  Status recall(const StereoFrame& frame);

  /// world_from_body at a moment without a pose: the last pose, moved on with the last motion's velocity.
  std::optional<Pose> predict(Stamp stamp) const;

  /// How the world lies: whether gravity and east were measured.
  bool gravity_measured() const;
  bool heading_east() const;

  /// The pair that drives the odometry.
  const std::string& odometry_pair() const;

  /// All stages' memory as a versioned value, but for the maps that were flushed.
  Bytes save() const;
  /// `maps`: the store as it was flushed with that memory.
  Status restore(const Bytes& state, TileStore& maps);

 private:
  struct State;
  explicit Pipeline(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace spartan
