#include "spartan/system/pipeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/system/world_frame.h"

namespace spartan {
namespace {

constexpr std::uint32_t kStateVersion = 1;
constexpr std::size_t kGravitySamples = 2000;  // newest ones before the first frame

const StereoPair* pair_for_odometry(const Rig& rig, const std::string& wanted) {
  if (!wanted.empty()) return rig.find_pair(wanted);
  const auto found = std::find_if(rig.pairs.begin(), rig.pairs.end(), [](const auto& p) { return p.for_odometry; });
  return found == rig.pairs.end() ? nullptr : &*found;
}

}  // namespace

struct Pipeline::State {
  State(Rig rig_in, const RunOptions& options_in, Imager imager_in, const StereoPair& pair_in, const Workers& workers)
      : rig(std::move(rig_in)),
        options(options_in),
        pair(pair_in),
        imager(std::move(imager_in)),
        odometer(options_in.odometry, workers),
        disparity_computer(options_in.reconstruction, workers) {}

  Rig rig;
  RunOptions options;
  StereoPair pair;
  Imager imager;
  Odometer odometer;
  DisparityComputer disparity_computer;
  StageClock clock;

  // The memory from frame to frame.
  std::vector<ImuSample> samples_at_rest;
  std::optional<Eigen::Vector3d> up_in_body;
  bool started = false;
  Stamp last_stamp;
  UncertainPose world_from_left;
  Pose left_from_body;
  Vector6d velocity = Vector6d::Zero();  // tangent of previous_from_current in the left frame, per second
  double distance_m = 0;
  double distance_of_last_terrain_m = -1;

  void start(const RectifiedPair& shot);
  void advance(const MotionEstimate& motion);
  bool terrain_is_due() const;
  Result<TerrainView> reconstruct(const RectifiedPair& shot);
};

void Pipeline::State::start(const RectifiedPair& shot) {
  up_in_body = measure_up(samples_at_rest, options.gravity_m_s2);
  samples_at_rest.clear();
  samples_at_rest.shrink_to_fit();
  world_from_left = {first_world_from_body(shot.body_from_left, up_in_body) * shot.body_from_left, Matrix6d::Zero()};
  started = true;
}

void Pipeline::State::advance(const MotionEstimate& motion) {
  world_from_left = compose(world_from_left, {motion.previous_from_current, motion.covariance});
  distance_m += motion.previous_from_current.translation().norm();
  const double seconds = seconds_between(motion.from, motion.to);
  if (seconds > 0) velocity = log_se3(motion.previous_from_current) / seconds;
}

bool Pipeline::State::terrain_is_due() const {
  if (!options.terrain.enabled) return false;
  return distance_of_last_terrain_m < 0 || distance_m - distance_of_last_terrain_m >= options.terrain.every_m;
}

Result<TerrainView> Pipeline::State::reconstruct(const RectifiedPair& shot) {
  const DisparityRange range = disparity_range(shot.geometry, pair.nearest_m);
  auto image = disparity_computer.compute(shot.left, shot.right, range, shot.left_mask, shot.right_mask);
  if (!image) return failure(image);
  distance_of_last_terrain_m = distance_m;
  return TerrainView{shot, image->disparity, world_from_left.pose};
}

Result<Pipeline> Pipeline::create(const Rig& rig, const RunOptions& options, Workers workers,
                                  const std::string& mask_folder) {
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

void Pipeline::add(const ImuSample& sample) {
  State& s = *state_;
  if (s.started) return;
  if (s.samples_at_rest.size() >= kGravitySamples) s.samples_at_rest.erase(s.samples_at_rest.begin());
  s.samples_at_rest.push_back(sample);
}
void Pipeline::add(const WheelSample&) {}
void Pipeline::add(const CompassSample&) {}
void Pipeline::add(const InclinometerSample&) {}

Result<std::optional<FrameResult>> Pipeline::add(const StereoFrame& frame) {
  State& s = *state_;
  if (frame.pair != s.pair.name) {
    if (s.rig.find_pair(frame.pair) != nullptr) return std::nullopt;
    return failure(ErrorCode::input, fmt::format("the rig has no pair named '{}'", frame.pair),
                   fmt::format("frame {}", frame.frame_id), "frames carry the name of their pair in the rig");
  }
  const auto shot = s.clock.measure("imaging", [&] { return s.imager.process(frame); });
  if (!shot) return failure(shot);

  if (!s.started) s.start(*shot);
  s.left_from_body = shot->body_from_left.inverse();

  FrameResult result;
  result.motion = s.clock.measure("odometry", [&] { return s.odometer.add(*shot); });
  if (!result.motion.first) s.advance(result.motion);
  s.last_stamp = shot->stamp;
  result.frame_id = frame.frame_id;
  result.pair = frame.pair;
  result.stamp = shot->stamp;
  result.world_from_body = compose(s.world_from_left, {s.left_from_body, Matrix6d::Zero()});

  if (s.terrain_is_due()) {
    auto terrain = s.clock.measure("reconstruction", [&] { return s.reconstruct(*shot); });
    if (!terrain) return failure(terrain);
    result.terrain = std::move(*terrain);
  }
  result.times = s.clock.take();
  return result;
}

std::optional<Pose> Pipeline::predict(Stamp stamp) const {
  const State& s = *state_;
  if (!s.started) return std::nullopt;
  const double seconds = seconds_between(s.last_stamp, stamp);
  return s.world_from_left.pose * exp_se3(s.velocity * seconds) * s.left_from_body;
}

bool Pipeline::gravity_measured() const {
  return state_->up_in_body.has_value();
}
const std::string& Pipeline::odometry_pair() const {
  return state_->pair.name;
}

Bytes Pipeline::save() const {
  const State& s = *state_;
  ArchiveWriter out;
  out.put(kStateVersion);
  out.put(static_cast<std::uint64_t>(s.samples_at_rest.size()));
  for (const ImuSample& sample : s.samples_at_rest) {
    out.put(sample.stamp.ns);
    out.put(sample.gyro_rad_s);
    out.put(sample.accel_m_s2);
  }
  out.put(s.up_in_body.has_value());
  out.put(s.up_in_body.value_or(Eigen::Vector3d::Zero()));
  out.put(s.started);
  out.put(s.last_stamp.ns);
  out.put(s.world_from_left.pose);
  out.put(s.world_from_left.covariance);
  out.put(s.left_from_body);
  out.put_array(s.velocity.data(), 6);
  out.put(s.distance_m);
  out.put(s.distance_of_last_terrain_m);
  const Bytes odometry = s.odometer.save();
  out.put_array(odometry.data(), odometry.size());
  return out.take();
}

Status Pipeline::restore(const Bytes& state) {
  ArchiveReader in(state);
  if (in.get<std::uint32_t>() != kStateVersion) {
    return failure(ErrorCode::configuration, "the saved state is of another version of the program", "run.sqlite",
                   "run again into a new folder");
  }
  State& s = *state_;
  const auto at_rest = std::min<std::uint64_t>(in.get<std::uint64_t>(), kGravitySamples);
  s.samples_at_rest.clear();
  for (std::uint64_t i = 0; i < at_rest; ++i) {
    const Stamp stamp{in.get<std::int64_t>()};
    const Eigen::Vector3d gyro = in.get_vector3();
    s.samples_at_rest.push_back({stamp, gyro, in.get_vector3()});
  }
  const bool has_up = in.get<bool>();
  const Eigen::Vector3d up = in.get_vector3();
  s.up_in_body = has_up ? std::optional(up) : std::nullopt;
  s.started = in.get<bool>();
  s.last_stamp.ns = in.get<std::int64_t>();
  s.world_from_left.pose = in.get_pose();
  s.world_from_left.covariance = in.get_matrix6();
  s.left_from_body = in.get_pose();
  const std::vector<double> velocity = in.get_array<double>();
  if (velocity.size() == 6) s.velocity = Eigen::Map<const Vector6d>(velocity.data());
  s.distance_m = in.get<double>();
  s.distance_of_last_terrain_m = in.get<double>();
  const Bytes odometry = in.get_array<std::uint8_t>();
  if (Status status = in.finish("run.sqlite: memory of the pipeline"); !status) return status;
  return s.odometer.restore(odometry);
}

}  // namespace spartan
