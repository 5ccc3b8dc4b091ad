// The stages of a Pipeline and their state from frame to frame, shared by processing (pipeline.cpp) and by saving and
// restoring (pipeline_saving.cpp).
#pragma once

#include <ctime>
#include <memory>
#include <optional>
#include <utility>

#include "spartan/localization/localizer.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/system/internal/back_end.h"
#include "spartan/system/internal/frozen_cameras.h"
#include "spartan/system/internal/keyframe_stage.h"
#include "spartan/system/internal/stop_stage.h"
#include "spartan/system/internal/terrain_stage.h"
#include "spartan/system/pipeline.h"

namespace spartan {

namespace internal {

/// The localization options with the gravity of the run's options, or that of the Earth if they state none.
LocalizationOptions with_gravity(const RunOptions& options);

/// Of a frame with one image, only the motion is measured.
inline bool has_both_images(const RectifiedPair& pair) {
  return !pair.left.empty() && !pair.right.empty();
}

}  // namespace internal

struct Pipeline::State {
  // The options are valid, so that create() of a stage cannot fail.
  State(Rig rig_in, const RunOptions& options_in, Imager imager_in, const StereoPair& pair_in,
        const ThreadPool& workers_in, Pace pace_in)
      : rig(std::move(rig_in)),
        options(options_in),
        pair(pair_in),
        workers(workers_in),
        imager(std::move(imager_in)),
        pace(pace_in),
        back_end(workers_in, pace_in == Pace::live),
        odometer(Odometer::create(options_in.odometry, workers_in).value()),
        disparity_computer(DisparityComputer::create(options_in.reconstruction, disparity_workers()).value()),
        localizer(Localizer::create(internal::with_gravity(options_in)).value()),
        odometry_filter(VisionOnlyFilter::create(internal::with_gravity(options_in)).value()),
        slam_filter(VisionOnlyFilter::create(internal::with_gravity(options_in)).value()),
        dead_reckoning(DeadReckoning::create(options_in.localization.vision).value()),
        terrain_stage(options_in.terrain),
        stop_stage(StopMapper::create(options_in.reconstruction, options_in.mapping, back_end.workers()).value(),
                   options_in.stop_delay_frames),
        keyframe_stage(StopMapper::create(options_in.reconstruction, options_in.mapping, back_end.one_thread()).value(),
                       options_in.keyframes, options_in.mapping.map.extent_m),
        merger(MapMerger::create(options_in.slam, options_in.mapping.map, workers_in).value()),
        frozen_cameras(rig.pairs.size()) {
    const bool several = rig.pairs.size() > 1, maps = options.maps && !options.odometry_only;
    maps_keyframes =
        maps && (options.maps_from == MapSource::keyframes || (options.maps_from == MapSource::automatic && !several));
    maps_stops = maps && !maps_keyframes && several;
    computes_terrain = options.terrain.enabled && !options.odometry_only;
    if (options.smoothed_trajectory && !options.odometry_only) localizer.keep_inputs();
  }

  // The jobs of the back end use the other members.
  ~State() { back_end.stop(); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  bool odometry_is_dense() const { return options.odometry.reconstruction.source == DisparitySource::dense; }
  // Only the odometry uses dense disparities in the front end.
  const ThreadPool& disparity_workers() const { return odometry_is_dense() ? workers : back_end.workers(); }

  Rig rig;
  RunOptions options;
  StereoPair pair;
  ThreadPool workers;
  Imager imager;
  Pace pace;
  internal::BackEnd back_end;
  Odometer odometer;
  DisparityComputer disparity_computer;  // of dense odometry, else of the jobs of terrain_stage
  Localizer localizer;
  VisionOnlyFilter odometry_filter, slam_filter;  // poses of the odometry, without and with map corrections
  DeadReckoning dead_reckoning;                   // replaces the three filters if the odometry runs alone
  internal::TerrainStage terrain_stage;
  internal::StopStage stop_stage;
  internal::KeyframeStage keyframe_stage;
  MapMerger merger;
  internal::FrozenCameras frozen_cameras;
  bool maps_stops = false, maps_keyframes = false, computes_terrain = false;
  StageClock clock;

  std::optional<Eigen::Vector3d> up_in_body;  // at the start, by align_with_gravity()

  // State from frame to frame.
  bool started = false;
  Stamp last_stamp;
  Pose world_from_left;  // by odometry alone
  Pose left_from_body;   // of the last frame
  // The frame at which the next motion of the odometry begins: the last one whose motion was measured.
  struct Reference {
    Stamp stamp;
    Pose world_from_left, left_from_body;
    Pose odom_from_body;  // by the localization
  };
  Reference reference;
  Vector6d velocity = Vector6d::Zero();  // tangent of previous_from_current in the body frame, per second
  double distance_m = 0;
  bool view_was_dropped = false;  // the last view

  std::size_t index_of(const StereoPair& of) const { return static_cast<std::size_t>(&of - rig.pairs.data()); }
  LocalizationEstimate localized_at(Stamp stamp) const;
  Status check_new(const StereoFrame& frame, std::size_t pair_index,
                   const internal::FrozenCameras::Fingerprints& images) const;
  void start(const RectifiedPair& rectified);
  std::optional<Pose> predicted_motion(const RectifiedPair& rectified) const;
  std::optional<Pose> motion_by_sensors(const RectifiedPair& rectified) const;
  RelativeMotion body_motion(const Pose& body_from_left, const MotionEstimate& motion) const;
  void advance(const RectifiedPair& rectified, const MotionEstimate& motion, const RelativeMotion& body_motion);
  void add_sensor_sample(const Measurement& sample);
  void localize(const RelativeMotion& motion);
  Status add_odometry_frame(const StereoFrame& frame, const RectifiedPair& rectified, const RelativeMotion& motion);
  void apply_map_constraint(const internal::StopSurvey& survey, const PoseConstraint& constraint);
  Status add_view(const StereoFrame& frame);
  bool is_made(internal::BackEnd::Ticket ticket) const { return pace == Pace::recorded || back_end.is_done(ticket); }
  Status start_maps();
  Result<std::optional<MappedStop>> apply_due_map(bool leaves_stop);
  Status start_stop_match();
  Result<std::optional<MappedStop>> map_at_departure();
  Result<MappedStop> finish_departed_stop();
  Result<std::optional<MappedStop>> finish_stop();
  Status start_keyframe_map();
  Result<MappedStop> finish_keyframe();
  MappedStop apply(const internal::StopSurvey& survey, MapMergeResult merged);
  void update_keyframes(const RectifiedPair& rectified, const MotionEstimate& motion,
                        const RelativeMotion& body_motion);
  TerrainView take_terrain();
  std::optional<TerrainView> take_ready_terrain();
  void update_terrain(const RectifiedPair& rectified, const DisparityImage& dense);
  Status check_disparities(const RectifiedPair& rectified) const;
  Result<DisparityImage> disparity_for_odometry(const RectifiedPair& rectified);

  // The map of the pending keyframe; null before its job is submitted.
  struct KeyframeMap {
    Result<MapMergeResult> matched;
    StageClock clock{CLOCK_THREAD_CPUTIME_ID};
    internal::BackEnd::Ticket ticket = 0;
  };
  std::shared_ptr<KeyframeMap> keyframe_map;
};

}  // namespace spartan
