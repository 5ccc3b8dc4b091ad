// Pipeline: all stages from stereo frames and sensor samples to poses, terrain and maps in one object.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "spartan/camera/samples.h"
#include "spartan/core/archive.h"
#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/stage_clock.h"
#include "spartan/core/threads.h"
#include "spartan/imaging/imager.h"
#include "spartan/localization/localizer.h"
#include "spartan/odometry/odometer.h"
#include "spartan/rig/rig.h"
#include "spartan/slam/map_merger.h"
#include "spartan/system/run_options.h"

namespace spartan {

/// Dense disparity of one frame with its pose.
struct TerrainView {
  std::string pair;
  Stamp stamp;
  RectifiedStereo geometry;
  Image<std::uint8_t> left;  ///< rectified
  Image<float> disparity;    ///< px, NaN unknown
  Image<float> sigma;        ///< standard deviation of the disparity, px
  Pose world_from_left;      ///< rectified left optical frame; world of the localization, as of the maps
};

/// Whether frames wait for the back end, which makes terrain views and maps.
enum class Pace {
  recorded,  ///< what it makes enters at a stated frame, which waits for it: results do not depend on time
  live,      ///< no frame waits: what it makes enters at that frame or at the first one at which it is ready
};

/// Result of mapping a stop that the rover has left, or a keyframe, some frames later.
struct MappedStop {
  std::int64_t position_id = -1;  ///< -1: a keyframe
  Stamp stamp;                    ///< of the odometry pair's first frame at the stop, or of the keyframe
  int views = 0;
  UncertainPose prior;    ///< world_from_body before map matching
  MapMergeResult merged;  ///< match, corrected pose, and the local map at that pose
  double seconds = 0;     ///< from leaving the stop, or from the keyframe, to its application; for reports only
};

/// Result of one frame of the odometry pair. `slam`, `localization`, `terrain` and `stop` are empty in a run by
/// odometry alone (RunOptions::odometry_only).
struct FrameResult {
  std::int64_t frame_id = 0;
  std::string pair;
  Stamp stamp;
  UncertainPose world_from_body;                     ///< by odometry alone; the covariance includes its constant errors
  MotionEstimate motion;                             ///< its covariance includes the errors of the calibration
  std::optional<UncertainPose> slam;                 ///< world_from_body: odometry corrected by map matching
  std::optional<LocalizationEstimate> localization;  ///< by all sensors
  std::optional<TerrainView> terrain;                ///< of an earlier frame, see TerrainOptions
  std::optional<MappedStop> stop;                    ///< an earlier stop or keyframe whose map was applied now
  std::vector<StageTime> times;
};

/// Computes poses, terrain and maps from pushed samples. `spartan run` feeds it from a recording or a live stream; a
/// ROS node can push samples from memory that it owns. A front end (imaging, odometry, localization) answers within
/// add(); a back end makes terrain views and maps beside it. Not thread-safe; one pipeline per rover.
class Pipeline {
 public:
  /// Self-masks are read from `mask_folder` (the folder of the rig file). Code `configuration`: rig or options are
  /// invalid; the error names every option that is out of bounds.
  static Result<Pipeline> create(const Rig& rig, const RunOptions& options, ThreadPool workers,
                                 const std::string& mask_folder = {}, Pace pace = Pace::recorded);
  Pipeline(Pipeline&&) noexcept;
  Pipeline& operator=(Pipeline&&) noexcept;
  ~Pipeline();

  /// Code `resources` where the disparity images of a pair need more than `most_bytes` (0: no bound); names the pair.
  Status check_memory(std::int64_t most_bytes) const;

  /// Gravity alignment from IMU samples of a stationary rover that cannot be added before the first frame. Used only if
  /// no sample that is added before the first frame measures gravity.
  void align_with_gravity(std::span<const ImuSample> stationary_samples);

  /// Sensor samples. Those before the first frame also initialize gravity and heading of the world frame.
  void add(const ImuSample& sample);
  void add(const WheelSample& sample);
  void add(const CompassSample& sample);
  void add(const InclinometerSample& sample);

  /// Processes one stereo frame. Only frames of the odometry pair have a result, and only of them one image may be
  /// missing: the landmarks are then measured in the other one. Frames of other pairs are views of the
  /// stop whose position_id they carry; the back end maps the stop when the odometry pair reports another position_id.
  /// After an error the state is as before the call: the next frame, or the same frame again, may be added.
  /// Codes: `frame_rejected` (the images do not fit the rig, the rig has no such pair, or an image equals the previous
  /// one of its camera bit for bit, which the noise of a sensor excludes; images with one value in all pixels are
  /// exempt; at Pace::live, a view of a stop while as many as `kMostViews` views or `kMostStops` stops wait for
  /// the back end), `store_damaged` (a
  /// map tile cannot be read).
  Result<std::optional<FrameResult>> add(const StereoFrame& frame);

  /// Why add() has just rejected the frame with the code `frame_rejected`: `frozen`, `dropped` or `wrong_size`.
  FrameFault fault_of(const StereoFrame& frame) const;

  /// From now on tiles of the global map may be paged out to `store`, which must contain this pipeline's map or be
  /// empty. Borrowed. flush_maps() writes all changes, inside the current transaction of the store's database.
  void store_maps_in(TileStore& store);
  Status flush_maps();
  /// The same where another thread writes: `store` is read only, and tiles are paged out after map_changes_stored().
  MapChanges take_map_changes();
  void map_changes_stored(std::uint64_t number);
  GlobalMap& global_map();

  /// For the end of a drive: waits for the map of a stop, the current one included, or of a keyframe, and applies it.
  /// To be called until there is none. After an error the call may be repeated.
  Result<std::optional<MappedStop>> finish_stop();
  /// Waits for the terrain view that is to be delivered with a later frame, if there is one.
  std::optional<TerrainView> finish_terrain();

  /// Times of the stages since the last result: views of a stop and its mapping.
  std::vector<StageTime> take_stage_times();
  /// What the localization was given since the last call (Localizer::take_inputs); empty where nothing
  /// is smoothed.
  Bytes take_localization_inputs();

  /// After restore(): frames that the back end was to work on, whose images must be passed to restore_frame() again, in
  /// this order, before the next frame is added.
  std::vector<FrameKey> pending_frames() const;
  Status restore_frame(const StereoFrame& frame);
  /// Instead, where their images are lost: no map and no terrain view is made of them.
  void abandon_pending_frames();

  /// By all sensors, at the newest sample, e.g. after each one of the IMU. None before the first frame, and in a run by
  /// odometry alone.
  std::optional<LocalizationEstimate> estimate() const;
  /// The same at a time between the oldest and the newest sample that the localization holds (Localizer::estimate_at).
  std::optional<LocalizationEstimate> estimate_at(Stamp stamp) const;

  /// world_from_body at a time without a pose: the last pose extrapolated at constant velocity.
  std::optional<Pose> predict(Stamp stamp) const;

  /// Up in the body frame, and the velocity of the body (m/s, rad/s; body axes) by the last two poses.
  Eigen::Vector3d up_in_body() const;
  Vector6d body_velocity() const;

  /// The vertical of the world where no sensor measures it, e.g. the normal of the ground in the first images. Call
  /// before the first frame.
  void align_with_ground(const Eigen::Vector3d& up_in_body);
  /// Whether the world frame was initialized by measured gravity and a measured heading.
  bool gravity_measured() const;
  bool heading_east() const;

  /// Of a pipeline that was created with Pace::live: whether frames wait for the back end from now on, e.g. while a
  /// resumed run processes what was recorded.
  void set_pace(Pace pace);

  /// From now on a watchdog can see in `front_end` which stage runs. Borrowed.
  void show_stages_in(RunningStage& front_end);
  /// Whether views of a stop are collected or the map of one is made.
  bool maps_a_stop() const;
  /// The job of the back end that runs now.
  const RunningStage& back_end_stage() const;
  /// Ends what the back end computes; nothing may be added any more. What was pending is in save().
  void stop_back_end();

  /// Name of the pair that drives the odometry.
  const std::string& odometry_pair() const;

  /// State of all stages, versioned; without the map tiles that were flushed.
  Bytes save() const;
  /// `maps`: the store as it was flushed with that state. Codes: `configuration` where the state is of another version,
  /// `store_damaged`.
  Status restore(const Bytes& state, TileStore& maps);

 private:
  /// Views of stops that may wait for the back end at Pace::live.
  static constexpr int kMostViews = 12;
  /// Stops that the rover has left and whose maps may wait to be made or applied: tens of MB each.
  static constexpr int kMostStops = 4;

  struct State;
  explicit Pipeline(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace spartan
