#include "spartan/system/pipeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "spartan/localization/dead_reckoning.h"
#include "spartan/localization/start_frame.h"
#include "spartan/localization/vision_only_filter.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/system/internal/position_stage.h"

namespace spartan {
namespace {

constexpr std::uint32_t kStateVersion = 5;
constexpr double kGravityOnEarth_m_s2 = 9.81;

LocalizationOptions with_gravity(const RunOptions& options) {
  LocalizationOptions localization = options.localization;
  localization.gravity_m_s2 = options.gravity_m_s2 > 0 ? options.gravity_m_s2 : kGravityOnEarth_m_s2;
  return localization;
}

const StereoPair* pair_for_odometry(const Rig& rig, const std::string& wanted) {
  if (!wanted.empty()) return rig.find_pair(wanted);
  const auto found = std::find_if(rig.pairs.begin(), rig.pairs.end(), [](const auto& p) { return p.for_odometry; });
  return found == rig.pairs.end() ? nullptr : &*found;
}

}  // namespace

struct Pipeline::State {
  State(Rig rig_in, const RunOptions& options_in, Imager imager_in, const StereoPair& pair_in,
        const ThreadPool& workers)
      : rig(std::move(rig_in)),
        options(options_in),
        pair(pair_in),
        imager(std::move(imager_in)),
        odometer(options_in.odometry, workers),
        disparity_computer(options_in.reconstruction, workers),
        localizer(with_gravity(options_in)),
        odometry_track(with_gravity(options_in)),
        slam_track(with_gravity(options_in)),
        dead_reckoning(options_in.localization.vision),
        position(options_in.reconstruction, options_in.mapping, workers),
        merger(options_in.slam, options_in.mapping.map, workers) {
    maps_positions = options.maps && rig.pairs.size() > 1 && !options.odometry_only;
    makes_terrain = options.terrain.enabled && !options.odometry_only;
  }

  Rig rig;
  RunOptions options;
  StereoPair pair;
  Imager imager;
  Odometer odometer;
  DisparityComputer disparity_computer;
  Localizer localizer;
  VisionOnlyFilter odometry_track, slam_track;  // the odometry's poses, without and with the map's corrections
  DeadReckoning dead_reckoning;                 // in the place of all three where the odometry runs alone
  PositionStage position;
  MapMerger merger;
  bool maps_positions = false, makes_terrain = false;
  StageClock clock;

  std::optional<Eigen::Vector3d> up_in_body;  // at the start, as level() was told

  // The memory from frame to frame.
  bool started = false;
  Stamp last_stamp;
  Pose world_from_left;  // by the odometry
  Pose left_from_body;
  Vector6d velocity = Vector6d::Zero();  // tangent of previous_from_current in the left frame, per second
  double distance_m = 0;
  double distance_of_last_terrain_m = -1;

  void start(const RectifiedPair& shot);
  void advance(const MotionEstimate& motion);
  RelativeMotion body_motion(const RectifiedPair& shot, const MotionEstimate& motion) const;
  void take(const Measurement& sample);
  void localize(const RelativeMotion& moved);
  Status pass(const StereoFrame& frame, const RectifiedPair& shot, const RelativeMotion& moved);
  void hear_map(const PositionSurvey& survey, const PoseConstraint& constraint);
  Status look(const StereoFrame& frame);
  Result<std::optional<MappedPosition>> leave_position();
  bool terrain_is_due() const;
  Status check_disparities(const RectifiedPair& shot) const;
  Result<ImageView<const float>> dense_disparity(const RectifiedPair& shot);
  Result<ImageView<const float>> disparity_for_odometry(const RectifiedPair& shot);
};

void Pipeline::State::start(const RectifiedPair& shot) {
  localizer.start(shot.stamp, shot.body_from_left.rotation() * Eigen::Vector3d::UnitZ(), up_in_body);
  const Pose first = localizer.estimate().world_from_body.pose;
  if (!options.odometry_only) {
    odometry_track.start(shot.stamp, first);
    slam_track.start(shot.stamp, first);
  }
  world_from_left = first * shot.body_from_left;
  started = true;
}

void Pipeline::State::advance(const MotionEstimate& motion) {
  world_from_left = world_from_left * motion.previous_from_current;
  distance_m += motion.previous_from_current.translation().norm();
  const double seconds = seconds_between(motion.from, motion.to);
  if (seconds > 0) velocity = log_se3(motion.previous_from_current) / seconds;
}

// M moves the left eye: B M B⁻¹ moves the body, and B M Exp(ξ) B⁻¹ = B M B⁻¹ Exp(Ad_B ξ).
RelativeMotion Pipeline::State::body_motion(const RectifiedPair& shot, const MotionEstimate& motion) const {
  const Pose& body_from_left = shot.body_from_left;
  const Matrix6d turn = adjoint(body_from_left);
  RelativeMotion moved;
  moved.from = motion.from;
  moved.to = motion.to;
  moved.measured = motion.status != TrackingStatus::lost;
  // That the rover stood is told by the exact identity.
  if (motion.status != TrackingStatus::stationary)
    moved.previous_from_current = body_from_left * motion.previous_from_current * body_from_left.inverse();
  moved.covariance = turn * motion.covariance * turn.transpose();
  return moved;
}

// The odometry alone needs to know only how the world lies at the start.
void Pipeline::State::take(const Measurement& sample) {
  if (!options.odometry_only || !started) localizer.add(sample);
}

void Pipeline::State::localize(const RelativeMotion& moved) {
  localizer.add(moved);
  odometry_track.add(moved);
  slam_track.add(moved);
}

Status Pipeline::State::pass(const StereoFrame& frame, const RectifiedPair& shot, const RelativeMotion& moved) {
  if (!maps_positions) return {};
  return position.pass(frame.position_id, shot, pair.nearest_m, localizer.estimate().world_from_body,
                       {moved.previous_from_current, moved.covariance});
}

// A further view of the position at hand.
Status Pipeline::State::look(const StereoFrame& frame) {
  if (!maps_positions || frame.position_id < 0) return {};
  const auto shot = clock.measure("imaging", [&] { return imager.process(frame); });
  if (!shot) return failure(shot);
  clock.add(shot->times);
  const double nearest_m = rig.find_pair(frame.pair)->nearest_m;
  return clock.measure("reconstruction",
                       [&] { return position.look(frame.position_id, frame.pair, *shot, nearest_m); });
}

Result<std::optional<MappedPosition>> Pipeline::State::leave_position() {
  if (position.mapper().views().empty()) {
    position.leave();
    return std::nullopt;
  }
  const auto survey = clock.measure("mapping", [&] { return position.survey(); });
  auto merged = clock.measure("slam", [&] { return merger.add(survey->points, survey->stamp, survey->standing); });
  if (!merged) return failure(merged);  // the position stays at hand
  position.leave();
  if (merged->constraint) hear_map(*survey, *merged->constraint);
  return MappedPosition{survey->position_id, survey->stamp, survey->views, survey->standing, std::move(*merged)};
}

// Of the poses at a stop the last one is the one that a long stop leaves in the filters.
void Pipeline::State::hear_map(const PositionSurvey& survey, const PoseConstraint& constraint) {
  const PoseConstraint last = transported(constraint, survey.since_arrival, survey.last_stamp);
  localizer.add(localizer.reaches(constraint.stamp) ? constraint : last);
  slam_track.add(slam_track.reaches(constraint.stamp) ? constraint : last);
}

bool Pipeline::State::terrain_is_due() const {
  if (!makes_terrain) return false;
  return distance_of_last_terrain_m < 0 || distance_m - distance_of_last_terrain_m >= options.terrain.every_m;
}

// Whether the terrain and the map of a stop can be computed from this pair, if they become due.
Status Pipeline::State::check_disparities(const RectifiedPair& shot) const {
  if (!maps_positions && !makes_terrain) return {};
  return StopMapper::check(shot, pair.nearest_m);
}

// The view is valid until the next call.
Result<ImageView<const float>> Pipeline::State::dense_disparity(const RectifiedPair& shot) {
  return clock.measure("reconstruction", [&]() -> Result<ImageView<const float>> {
    const DisparityRange range = disparity_range(shot.geometry, pair.nearest_m);
    auto image = disparity_computer.compute(shot.left, shot.right, range, shot.left_mask, shot.right_mask);
    if (!image) return failure(image);
    return image->disparity;
  });
}

// Empty if the odometry computes the disparities of its landmarks itself.
Result<ImageView<const float>> Pipeline::State::disparity_for_odometry(const RectifiedPair& shot) {
  if (options.odometry.reconstruction.source != DisparitySource::dense) return ImageView<const float>();
  return dense_disparity(shot);
}

Result<Pipeline> Pipeline::create(const Rig& rig, const RunOptions& options, ThreadPool workers,
                                  const std::string& mask_folder) {
  if (Status status = validate(options, "options"); !status) return failure(status);
  const StereoPair* const pair = pair_for_odometry(rig, options.odometry_pair);
  if (pair == nullptr) {
    return options.odometry_pair.empty()
               ? failure(ErrorCode::configuration, "the rig has no pair for the odometry", rig.name)
               : failure(ErrorCode::configuration, "the rig has no pair named '" + options.odometry_pair + "'",
                         "odometry_pair");
  }
  auto imager = Imager::create(rig, options.imaging, workers, mask_folder);
  if (!imager) return failure(imager);
  return Pipeline(std::make_unique<State>(rig, options, std::move(*imager), *pair, workers));
}

Pipeline::Pipeline(std::unique_ptr<State> state) : state_(std::move(state)) {}
Pipeline::Pipeline(Pipeline&&) noexcept = default;
Pipeline& Pipeline::operator=(Pipeline&&) noexcept = default;
Pipeline::~Pipeline() = default;

void Pipeline::level(std::span<const ImuSample> at_rest) {
  if (const auto rest = static_reading(at_rest, with_gravity(state_->options)))
    state_->up_in_body = rest->accel_m_s2.normalized();
}
void Pipeline::add(const ImuSample& sample) {
  state_->take(sample);
}
void Pipeline::add(const WheelSample& sample) {
  state_->take(sample);
}
void Pipeline::add(const CompassSample& sample) {
  state_->take(sample);
}
void Pipeline::add(const InclinometerSample& sample) {
  state_->take(sample);
}

Result<std::optional<FrameResult>> Pipeline::add(const StereoFrame& frame) {
  State& s = *state_;
  if (frame.pair != s.pair.name) {
    if (s.rig.find_pair(frame.pair) != nullptr) {
      if (Status status = s.look(frame); !status) return failure(status);
      return std::nullopt;
    }
    return failure(ErrorCode::frame_rejected, fmt::format("the rig has no pair named '{}'", frame.pair),
                   fmt::format("frame {}", frame.frame_id), "frames carry the name of their pair in the rig");
  }
  const auto shot = s.clock.measure("imaging", [&] { return s.imager.process(frame); });
  if (!shot) return failure(shot);
  s.clock.add(shot->times);
  auto disparity = s.disparity_for_odometry(*shot);
  if (!disparity) return failure(disparity);

  // What can fail comes first, here and in leave_position(); behind it every stage moves on, and none of them fails.
  if (Status fits = s.check_disparities(*shot); !fits) return failure(fits);
  FrameResult result;
  // Before the stages move on: the map belongs to where the rover still stands.
  if (s.maps_positions && frame.position_id != s.position.position_id()) {
    auto position = s.leave_position();
    if (!position) return failure(position);
    result.position = std::move(*position);
  }
  if (!s.started) s.start(*shot);
  s.left_from_body = shot->body_from_left.inverse();

  result.motion = s.clock.measure("odometry", [&] { return s.odometer.add(*shot, {}, *disparity); });
  const RelativeMotion moved = s.body_motion(*shot, result.motion);
  if (!result.motion.first) {
    s.advance(result.motion);
    if (s.options.odometry_only) s.dead_reckoning.add(moved);
  }
  if (!s.options.odometry_only) {
    s.clock.measure("localization", [&] {
      if (!result.motion.first) s.localize(moved);
    });
  }
  s.last_stamp = shot->stamp;
  result.frame_id = frame.frame_id;
  result.pair = frame.pair;
  result.stamp = shot->stamp;
  result.world_from_body.pose = s.world_from_left * s.left_from_body;
  if (s.options.odometry_only) {
    result.world_from_body.covariance = s.dead_reckoning.covariance();
  } else {
    result.world_from_body.covariance = s.odometry_track.world_from_body().covariance;
    result.localization = s.localizer.estimate();
    result.slam = s.slam_track.world_from_body();
  }
  if (Status status = s.pass(frame, *shot, moved); !status) return failure(status);

  if (s.terrain_is_due()) {
    if (disparity->empty()) disparity = s.dense_disparity(*shot);
    if (!disparity) return failure(disparity);
    s.distance_of_last_terrain_m = s.distance_m;
    result.terrain = TerrainView{*shot, *disparity, s.world_from_left};
  }
  result.times = s.clock.take();
  return result;
}

std::optional<Pose> Pipeline::predict(Stamp stamp) const {
  const State& s = *state_;
  if (!s.started) return std::nullopt;
  const double seconds = seconds_between(s.last_stamp, stamp);
  return s.world_from_left * exp_se3(s.velocity * seconds) * s.left_from_body;
}

Result<std::optional<MappedPosition>> Pipeline::leave_position() {
  return state_->leave_position();
}

std::vector<StageTime> Pipeline::take_times() {
  return state_->clock.take();
}

void Pipeline::page_maps_to(TileStore& store) {
  state_->merger.page_to(&store);
}
Status Pipeline::flush_maps() {
  return state_->merger.flush();
}
GlobalMap& Pipeline::global_map() {
  return state_->merger.map();
}

std::vector<FrameKey> Pipeline::wanted_shots() const {
  std::vector<FrameKey> wanted;
  if (const auto stamp = state_->position.wanted_arrival()) wanted.push_back({state_->pair.name, *stamp});
  const auto& looks = state_->position.wanted_looks();
  wanted.insert(wanted.end(), looks.begin(), looks.end());
  return wanted;
}

Status Pipeline::recall(const StereoFrame& frame) {
  State& s = *state_;
  const StereoPair* const pair = s.rig.find_pair(frame.pair);
  if (pair == nullptr)
    return failure(ErrorCode::frame_rejected, fmt::format("the rig has no pair named '{}'", frame.pair), "recall");
  const auto shot = s.imager.process(frame);
  if (!shot) return failure(shot);
  if (pair->name != s.pair.name) return s.position.look(frame.position_id, pair->name, *shot, pair->nearest_m);
  s.position.recall_arrival(*shot, s.pair.nearest_m);
  return {};
}

bool Pipeline::gravity_measured() const {
  return state_->localizer.estimate().gravity_measured;
}
bool Pipeline::heading_east() const {
  return state_->localizer.estimate().heading.east;
}
const std::string& Pipeline::odometry_pair() const {
  return state_->pair.name;
}

Bytes Pipeline::save() const {
  const State& s = *state_;
  ArchiveWriter out;
  out.put(kStateVersion);
  out.put(s.started);
  out.put(s.last_stamp.ns);
  out.put(s.up_in_body.has_value());
  out.put(s.up_in_body.value_or(Eigen::Vector3d::UnitZ()));
  out.put(s.world_from_left);
  out.put(s.left_from_body);
  out.put_array(s.velocity.data(), 6);
  out.put(s.distance_m);
  out.put(s.distance_of_last_terrain_m);
  s.position.save(out);
  const bool alone = s.options.odometry_only;
  for (const Bytes& stage :
       {s.odometer.save(), s.localizer.save(), alone ? s.dead_reckoning.save() : s.odometry_track.save(),
        alone ? Bytes() : s.slam_track.save(), s.merger.save()})
    out.put_array(stage.data(), stage.size());
  return out.take();
}

Status Pipeline::restore(const Bytes& state, TileStore& maps) {
  ArchiveReader in(state);
  if (in.get<std::uint32_t>() != kStateVersion) {
    return failure(ErrorCode::configuration, "the saved state is of another version of the program", "run.sqlite",
                   "run again into a new folder");
  }
  State& s = *state_;
  s.started = in.get<bool>();
  s.last_stamp.ns = in.get<std::int64_t>();
  const bool has_up = in.get<bool>();
  s.up_in_body = in.get_vector3();
  if (!has_up) s.up_in_body.reset();
  s.world_from_left = in.get_pose();
  s.left_from_body = in.get_pose();
  const std::vector<double> velocity = in.get_array<double>();
  if (velocity.size() == 6) s.velocity = Eigen::Map<const Vector6d>(velocity.data());
  s.distance_m = in.get<double>();
  s.distance_of_last_terrain_m = in.get<double>();
  s.position.restore(in);
  std::array<Bytes, 5> stages;
  for (Bytes& stage : stages) stage = in.get_array<std::uint8_t>();
  if (Status status = in.finish("run.sqlite: memory of the pipeline"); !status) return status;
  if (Status status = s.odometer.restore(stages[0]); !status) return status;
  if (Status status = s.localizer.restore(stages[1]); !status) return status;
  if (s.options.odometry_only) {
    if (Status status = s.dead_reckoning.restore(stages[2]); !status) return status;
  } else {
    if (Status status = s.odometry_track.restore(stages[2]); !status) return status;
    if (Status status = s.slam_track.restore(stages[3]); !status) return status;
  }
  return s.merger.restore(stages[4], maps);
}

}  // namespace spartan
