// The stages of a Pipeline and their state from frame to frame, shared by processing (pipeline.cpp) and by saving and
// restoring (pipeline_saving.cpp).
#pragma once

#include <ctime>
#include <optional>
#include <utility>

#include "spartan/localization/localizer.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/system/internal/frozen_cameras.h"
#include "spartan/system/internal/keyframe_stage.h"
#include "spartan/system/internal/stop_stage.h"
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
        const ThreadPool& workers_in)
      : rig(std::move(rig_in)),
        options(options_in),
        pair(pair_in),
        imager(std::move(imager_in)),
        odometer(Odometer::create(options_in.odometry, workers_in).value()),
        disparity_computer(DisparityComputer::create(options_in.reconstruction, workers_in).value()),
        localizer(Localizer::create(internal::with_gravity(options_in)).value()),
        odometry_filter(VisionOnlyFilter::create(internal::with_gravity(options_in)).value()),
        slam_filter(VisionOnlyFilter::create(internal::with_gravity(options_in)).value()),
        dead_reckoning(DeadReckoning::create(options_in.localization.vision).value()),
        stop_stage(StopMapper::create(options_in.reconstruction, options_in.mapping, workers_in).value()),
        keyframe_stage(StopMapper::create(options_in.reconstruction, options_in.mapping, ThreadPool(1)).value(),
                       options_in.keyframes, options_in.mapping.map.extent_m),
        merger(MapMerger::create(options_in.slam, options_in.mapping.map, workers_in).value()),
        frozen_cameras(rig.pairs.size()),
        workers(workers_in) {
    const bool several = rig.pairs.size() > 1, maps = options.maps && !options.odometry_only;
    maps_keyframes =
        maps && (options.maps_from == MapSource::keyframes || (options.maps_from == MapSource::automatic && !several));
    maps_stops = maps && !maps_keyframes && several;
    computes_terrain = options.terrain.enabled && !options.odometry_only;
    if (options.smoothed_trajectory && !options.odometry_only) localizer.keep_inputs();
  }

  Rig rig;
  RunOptions options;
  StereoPair pair;
  Imager imager;
  Odometer odometer;
  DisparityComputer disparity_computer;
  Localizer localizer;
  VisionOnlyFilter odometry_filter, slam_filter;  // poses of the odometry, without and with map corrections
  DeadReckoning dead_reckoning;                   // replaces the three filters if the odometry runs alone
  internal::StopStage stop_stage;
  internal::KeyframeStage keyframe_stage;
  MapMerger merger;
  internal::FrozenCameras frozen_cameras;
  ThreadPool workers;
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
  double distance_of_last_terrain_m = -1;

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
  Result<std::optional<MappedStop>> finish_stop();
  Status start_keyframe_map();
  void make_keyframe_map(const std::optional<MapExcerpt>& global);
  Result<MappedStop> finish_keyframe();
  MappedStop apply(const internal::StopSurvey& survey, MapMergeResult merged);
  void update_keyframes(const RectifiedPair& rectified, const MotionEstimate& motion,
                        const RelativeMotion& body_motion);
  bool terrain_is_due() const;
  Status check_disparities(const RectifiedPair& rectified) const;
  Result<DisparityImage> dense_disparity(const RectifiedPair& rectified);
  Result<DisparityImage> disparity_for_odometry(const RectifiedPair& rectified);

  // The map of the pending keyframe, made by one thread beside the frames that follow it.
  struct KeyframeMap {
    Result<MapMergeResult> matched;
    StageClock clock{CLOCK_THREAD_CPUTIME_ID};
  };
  KeyframeMap keyframe_map;
  BackgroundTask keyframe_task;  // the last member: it uses the others and ends before them
};

}  // namespace spartan
