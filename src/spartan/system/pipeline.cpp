#include "spartan/system/pipeline.h"

#include <fmt/format.h>

#include <cmath>

#include "spartan/system/internal/pipeline_state.h"

namespace spartan {

using namespace internal;

namespace {

constexpr double kGravityOnEarth_m_s2 = 9.81;
/// The newest sample of the localization is at most this old where it says how the rover has moved.
constexpr double kLatestSample_s = 0.05;
/// Largest angle between the body's z axis and the image's vertical at which z is taken for the vertical of a body that
/// nothing else levels.
constexpr double kMaxBodyTilt_rad = 1;

// What is up in the body of a rig, if no sensor tells: z, unless the camera contradicts it (the body of EuRoC and
// Kalibr is the IMU, with any axes).
Eigen::Vector3d assumed_up(const Pose& body_from_left) {
  const Eigen::Vector3d up_of_image = body_from_left.rotation() * -Eigen::Vector3d::UnitY();
  return up_of_image.z() > std::cos(kMaxBodyTilt_rad) ? Eigen::Vector3d::UnitZ().eval() : up_of_image;
}

}  // namespace

LocalizationOptions internal::with_gravity(const RunOptions& options) {
  LocalizationOptions localization = options.localization;
  localization.gravity_m_s2 = options.gravity_m_s2 > 0 ? options.gravity_m_s2 : kGravityOnEarth_m_s2;
  return localization;
}

// Before the frame is processed: a camera that repeats its image would look like a stationary rover.
Status Pipeline::State::check_new(const StereoFrame& frame, std::size_t pair_index,
                                  const FrozenCameras::Fingerprints& images) const {
  const auto frozen = frozen_cameras.find(pair_index, images);
  if (!frozen) return {};
  return failure(ErrorCode::frame_rejected, fmt::format("{} of pair '{}' repeated bit for bit", *frozen, frame.pair),
                 fmt::format("frame {}", frame.frame_id), "check whether the camera or its driver has stalled");
}

void Pipeline::State::start(const RectifiedPair& rectified) {
  localizer.start(rectified.stamp, rectified.body_from_left.rotation() * Eigen::Vector3d::UnitZ(), up_in_body,
                  assumed_up(rectified.body_from_left));
  const Pose first = localizer.estimate().world_from_body.pose;
  if (!options.odometry_only) {
    odometry_filter.start(rectified.stamp, first);
    slam_filter.start(rectified.stamp, first);
  }
  world_from_left = first * rectified.body_from_left;
  left_from_body = rectified.body_from_left.inverse();
  reference = {rectified.stamp, world_from_left, left_from_body, {}};
  started = true;
}

// The motion of the left camera since the reference, from the rover's velocity and the angles of the mast. Empty for a
// pair that is fixed to the body: the odometry predicts its motion itself.
std::optional<Pose> Pipeline::State::predicted_motion(const RectifiedPair& rectified) const {
  if (!started || rig.find_camera(pair.left)->mount == "body") return std::nullopt;
  const double seconds = seconds_between(reference.stamp, rectified.stamp);
  return reference.left_from_body * exp_se3(velocity * seconds) * rectified.body_from_left;
}

// The same motion by the other sensors, where the localization has samples up to the frame. Live, it has later ones.
std::optional<Pose> Pipeline::State::motion_by_sensors(const RectifiedPair& rectified) const {
  if (!started || options.odometry_only) return std::nullopt;
  const Stamp newest = localizer.estimate().stamp;
  if (!(seconds_between(newest, rectified.stamp) < kLatestSample_s)) return std::nullopt;
  const auto then = localizer.estimate_at(rectified.stamp);
  if (!then) return std::nullopt;
  const Pose body_motion = reference.odom_from_body.inverse() * then->odom_from_body.pose;
  return reference.left_from_body * body_motion * rectified.body_from_left;
}

// Transports the motion M of the left camera to the body, with B₀ and B₁ = body_from_left at its begin and end, which
// differ where the mast has moved: B₀ M Exp(ξ) B₁⁻¹ = (B₀ M B₁⁻¹) Exp(Ad_B₁ ξ), so the covariance becomes
// Ad_B₁ Σ Ad_B₁ᵀ. What the calibration leaves is added.
RelativeMotion Pipeline::State::body_motion(const Pose& body_from_left, const MotionEstimate& motion) const {
  const Matrix6d ad = adjoint(body_from_left);
  RelativeMotion result;
  result.from = motion.from;
  result.to = motion.to;
  result.measured = motion.status != TrackingStatus::lost;
  result.keeps_reference = motion.keeps_reference;
  // The exact identity marks a stationary rover.
  if (motion.status != TrackingStatus::stationary) {
    result.previous_from_current =
        reference.left_from_body.inverse() * motion.previous_from_current * body_from_left.inverse();
  }
  result.covariance = ad * motion.covariance * ad.transpose();
  if (result.measured) {
    result.by_calibration =
        calibration_effect(result.previous_from_current, body_from_left, rig, pair, options.mapping.map.calibration);
    result.covariance += result.by_calibration * result.by_calibration.transpose();
  }
  return result;
}

void Pipeline::State::advance(const RectifiedPair& rectified, const MotionEstimate& motion,
                              const RelativeMotion& body_motion) {
  const Pose last = world_from_left;
  world_from_left = reference.world_from_left * motion.previous_from_current;
  distance_m += (last.inverse() * world_from_left).translation().norm();
  left_from_body = rectified.body_from_left.inverse();
  const double seconds = seconds_between(motion.from, motion.to);
  if (seconds > 0) velocity = log_se3(body_motion.previous_from_current) / seconds;
  if (!motion.keeps_reference) reference = {motion.to, world_from_left, left_from_body, {}};
}

// At the time of a frame: live, newer samples of other sensors come before it.
LocalizationEstimate Pipeline::State::localized_at(Stamp stamp) const {
  const auto estimate = localizer.estimate_at(stamp);
  return estimate ? *estimate : localizer.estimate();
}

// The odometry alone needs sensor samples only to initialize the world frame.
void Pipeline::State::add_sensor_sample(const Measurement& sample) {
  if (!options.odometry_only || !started) localizer.add(sample);
}

void Pipeline::State::localize(const RelativeMotion& motion) {
  localizer.add(motion);
  odometry_filter.add(motion);
  slam_filter.add(motion);
}

TerrainView Pipeline::State::take_terrain() {
  back_end.wait(terrain_stage.ticket());
  return terrain_stage.take(clock);
}

// The pending view, if it is to be delivered with this frame; live, only if the back end has made it.
std::optional<TerrainView> Pipeline::State::take_ready_terrain() {
  if (!terrain_stage.is_pending()) return std::nullopt;
  const bool next_is_due = pace == Pace::recorded && terrain_stage.is_due(distance_m);
  if ((!terrain_stage.is_ready() && !next_is_due) || !is_made(terrain_stage.ticket())) return std::nullopt;
  return take_terrain();
}

// `dense`: of the odometry, or empty. Live, a view that is due while the back end makes another one waits for a later
// frame.
void Pipeline::State::update_terrain(const RectifiedPair& rectified, const DisparityImage& dense) {
  if (!computes_terrain || terrain_stage.is_pending() || !terrain_stage.is_due(distance_m)) return;
  if (!has_both_images(rectified)) return;
  // In the world of the maps.
  const Pose at = localized_at(rectified.stamp).world_from_body.pose * rectified.body_from_left;
  if (dense.disparity.empty()) {
    terrain_stage.begin(rectified, at, distance_m, pair.nearest_m, disparity_computer, back_end);
  } else {
    terrain_stage.begin(rectified, at, distance_m, dense);
  }
}

// Whether the disparities of this frame can be computed, if terrain or the map of a stop needs them.
Status Pipeline::State::check_disparities(const RectifiedPair& rectified) const {
  if ((!maps_stops && !maps_keyframes && !computes_terrain) || !has_both_images(rectified)) return {};
  return StopMapper::check(rectified, pair.nearest_m);
}

// Empty if the odometry computes the disparities of its landmarks itself. Valid until the next call.
Result<DisparityImage> Pipeline::State::disparity_for_odometry(const RectifiedPair& rectified) {
  if (!odometry_is_dense() || !has_both_images(rectified)) return DisparityImage();
  return clock.measure("reconstruction", [&] {
    return disparity_computer.compute(rectified.left, rectified.right,
                                      disparity_range(rectified.geometry, pair.nearest_m), rectified.left_mask,
                                      rectified.right_mask);
  });
}

Result<Pipeline> Pipeline::create(const Rig& rig, const RunOptions& options, ThreadPool workers,
                                  const std::string& mask_folder, Pace pace) {
  if (Status status = validate(options, "options"); !status) return failure(status);
  const StereoPair* const pair = odometry_pair_of(rig, options);
  if (pair == nullptr) {
    return options.odometry_pair.empty()
               ? failure(ErrorCode::configuration, "the rig has no pair for the odometry", rig.name,
                         "set for_odometry of a pair in the rig file, or the option odometry_pair")
               : failure(ErrorCode::configuration, "the rig has no pair named '" + options.odometry_pair + "'",
                         "odometry_pair");
  }
  auto imager = Imager::create(rig, options.imaging, workers, mask_folder);
  if (!imager) return failure(imager);
  const RunOptions resolved = resolved_options(options, rig);
  if (Status status = validate(resolved, "options with the values of the rig"); !status) return failure(status);
  return Pipeline(std::make_unique<State>(rig, resolved, std::move(*imager), *pair, workers, pace));
}

Pipeline::Pipeline(std::unique_ptr<State> state) : state_(std::move(state)) {}
Pipeline::Pipeline(Pipeline&&) noexcept = default;
Pipeline& Pipeline::operator=(Pipeline&&) noexcept = default;
Pipeline::~Pipeline() = default;

Status Pipeline::check_memory(std::int64_t most_bytes) const {
  const State& s = *state_;
  const bool odometry_needs = s.computes_terrain || s.odometry_is_dense();
  for (const StereoPair& pair : s.rig.pairs) {
    if (!s.maps_stops && !((odometry_needs || s.maps_keyframes) && pair.name == s.pair.name)) continue;
    const RectifiedStereo geometry = s.imager.geometry(pair.name);
    const DisparityRange range = disparity_range(geometry, pair.nearest_m);
    if (Status fits = DisparityComputer::check_memory(geometry.size, range, s.workers.threads(), most_bytes); !fits) {
      Error error = fits.error();
      error.where = "pair '" + pair.name + "'";
      return tl::unexpected(std::move(error));
    }
  }
  return {};
}

void Pipeline::align_with_gravity(std::span<const ImuSample> stationary_samples) {
  if (const auto reading = static_reading(stationary_samples, with_gravity(state_->options)))
    state_->up_in_body = reading->accel_m_s2.normalized();
}
void Pipeline::align_with_ground(const Eigen::Vector3d& up_in_body) {
  state_->up_in_body = up_in_body.normalized();
}
void Pipeline::add(const ImuSample& sample) {
  state_->add_sensor_sample(sample);
}
void Pipeline::add(const WheelSample& sample) {
  state_->add_sensor_sample(sample);
}
void Pipeline::add(const CompassSample& sample) {
  state_->add_sensor_sample(sample);
}
void Pipeline::add(const InclinometerSample& sample) {
  state_->add_sensor_sample(sample);
}

Result<std::optional<FrameResult>> Pipeline::add(const StereoFrame& frame) {
  State& s = *state_;
  if (frame.pair != s.pair.name) {
    if (s.rig.find_pair(frame.pair) != nullptr) {
      if (Status status = s.add_view(frame); !status) return failure(status);
      return std::nullopt;
    }
    return failure(ErrorCode::frame_rejected, fmt::format("the rig has no pair named '{}'", frame.pair),
                   fmt::format("frame {}", frame.frame_id), "StereoFrame::pair must be the name of a pair of the rig");
  }
  const std::size_t pair_index = s.index_of(*s.rig.find_pair(frame.pair));
  const auto images = FrozenCameras::fingerprints_of(frame);
  if (Status status = s.check_new(frame, pair_index, images); !status) return failure(status);
  const auto rectified = s.clock.measure("imaging", [&] { return s.imager.process(frame); });
  if (!rectified) return failure(rectified);
  s.clock.add(rectified->times);
  auto disparity = s.disparity_for_odometry(*rectified);
  if (!disparity) return failure(disparity);

  // All steps that can fail come first; the stages advance only after them.
  if (Status valid = s.check_disparities(*rectified); !valid) return failure(valid);
  if (Status started = s.start_maps(); !started) return failure(started);
  FrameResult result;
  // Before the stages advance: the map constraint applies to the pose at the stop.
  const bool leaves_stop = s.maps_stops && frame.position_id != s.stop_stage.position_id();
  auto map = s.apply_due_map(leaves_stop);
  if (!map) return failure(map);
  result.stop = std::move(*map);
  if (leaves_stop) s.stop_stage.depart(s.back_end);
  s.frozen_cameras.remember(pair_index, images);
  const std::optional<Pose> predicted = s.predicted_motion(*rectified), by_sensors = s.motion_by_sensors(*rectified);
  if (!s.started) s.start(*rectified);
  result.motion = s.clock.measure(
      "odometry", [&] { return s.odometer.add(*rectified, predicted, disparity->disparity, by_sensors); });
  // After lost frames the landmarks of the last one may be the only ones that are found.
  if (result.motion.from != s.reference.stamp) s.reference = {s.last_stamp, s.world_from_left, s.left_from_body, {}};
  const RelativeMotion body_motion = s.body_motion(rectified->body_from_left, result.motion);
  const Matrix6d to_left = adjoint(rectified->body_from_left.inverse());
  result.motion.covariance = to_left * body_motion.covariance * to_left.transpose();
  if (!result.motion.first) {
    s.advance(*rectified, result.motion, body_motion);
    if (s.options.odometry_only) s.dead_reckoning.add(body_motion);
  }
  if (!s.options.odometry_only) {
    s.clock.measure("localization", [&] {
      if (!result.motion.first) s.localize(body_motion);
    });
  }
  s.last_stamp = rectified->stamp;
  result.frame_id = frame.frame_id;
  result.pair = frame.pair;
  result.stamp = rectified->stamp;
  result.world_from_body.pose = s.world_from_left * s.left_from_body;
  if (s.options.odometry_only) {
    result.world_from_body.covariance = s.dead_reckoning.covariance();
  } else {
    result.world_from_body.covariance = s.odometry_filter.world_from_body().covariance;
    result.localization = s.localized_at(rectified->stamp);
    if (!result.motion.keeps_reference) s.reference.odom_from_body = result.localization->odom_from_body.pose;
    result.slam = s.slam_filter.world_from_body();
  }
  if (Status status = s.add_odometry_frame(frame, *rectified, body_motion); !status) return failure(status);
  s.update_keyframes(*rectified, result.motion, body_motion);

  s.terrain_stage.advance();
  result.terrain = s.take_ready_terrain();
  s.update_terrain(*rectified, *disparity);
  if (s.options.terrain.delay_frames == 0 && !result.terrain) result.terrain = s.take_ready_terrain();
  result.times = s.clock.take();
  return result;
}

FrameFault Pipeline::fault_of(const StereoFrame& frame) const {
  const State& s = *state_;
  const StereoPair* const pair = s.rig.find_pair(frame.pair);
  if (pair == nullptr) return FrameFault::wrong_size;
  if (s.view_was_dropped && pair->name != s.pair.name) return FrameFault::dropped;
  const bool frozen = s.frozen_cameras.find(s.index_of(*pair), FrozenCameras::fingerprints_of(frame)).has_value();
  return frozen ? FrameFault::frozen : FrameFault::wrong_size;
}

std::optional<LocalizationEstimate> Pipeline::estimate() const {
  if (!state_->started || state_->options.odometry_only) return std::nullopt;
  return state_->localizer.estimate();
}

std::optional<LocalizationEstimate> Pipeline::estimate_at(Stamp stamp) const {
  if (!state_->started || state_->options.odometry_only) return std::nullopt;
  return state_->localizer.estimate_at(stamp);
}

std::optional<Pose> Pipeline::predict(Stamp stamp) const {
  const State& s = *state_;
  if (!s.started) return std::nullopt;
  const double seconds = seconds_between(s.last_stamp, stamp);
  return s.world_from_left * s.left_from_body * exp_se3(s.velocity * seconds);
}

Eigen::Vector3d Pipeline::up_in_body() const {
  const State& s = *state_;
  if (!s.started) return s.up_in_body.value_or(Eigen::Vector3d::UnitZ());
  return (s.world_from_left * s.left_from_body).rotation().conjugate() * Eigen::Vector3d::UnitZ();
}

Vector6d Pipeline::body_velocity() const {
  return state_->velocity;
}

Result<std::optional<MappedStop>> Pipeline::finish_stop() {
  if (!state_->keyframe_stage.is_pending()) return state_->finish_stop();
  auto map = state_->finish_keyframe();
  if (!map) return failure(map);
  return std::move(*map);
}

std::optional<TerrainView> Pipeline::finish_terrain() {
  if (!state_->terrain_stage.is_pending()) return std::nullopt;
  return state_->take_terrain();
}

std::vector<StageTime> Pipeline::take_stage_times() {
  return state_->clock.take();
}

Bytes Pipeline::take_localization_inputs() {
  return state_->localizer.take_inputs();
}

void Pipeline::store_maps_in(TileStore& store) {
  state_->merger.page_to(&store);
}
Status Pipeline::flush_maps() {
  return state_->merger.flush();
}
MapChanges Pipeline::take_map_changes() {
  return state_->merger.take_changes();
}
void Pipeline::map_changes_stored(std::uint64_t number) {
  state_->merger.changes_stored(number);
}
GlobalMap& Pipeline::global_map() {
  return state_->merger.map();
}

bool Pipeline::gravity_measured() const {
  return state_->localizer.estimate().gravity_measured;
}
bool Pipeline::heading_east() const {
  return state_->localizer.estimate().heading.east;
}
void Pipeline::set_pace(Pace pace) {
  state_->pace = pace;
}
void Pipeline::show_stages_in(RunningStage& front_end) {
  state_->clock.show_in(front_end);
}
bool Pipeline::maps_a_stop() const {
  return state_->stop_stage.has_views() || state_->stop_stage.has_departed();
}
const RunningStage& Pipeline::back_end_stage() const {
  return state_->back_end.running();
}
void Pipeline::stop_back_end() {
  state_->back_end.stop();
}
const std::string& Pipeline::odometry_pair() const {
  return state_->pair.name;
}

}  // namespace spartan
