#include "spartan/sim/internal/frame_simulator.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "spartan/core/stage_clock.h"
#include "spartan/sim/internal/drive/body_motion.h"
#include "spartan/sim/internal/drive/motion_sensors.h"
#include "spartan/sim/internal/drive/rover_seed.h"
#include "spartan/sim/internal/world/wheel_tracks.h"

namespace spartan::sim::internal {
namespace {

constexpr double kSceneRadius_m = 2;   // frames within this distance of the first one share a scene
constexpr double kFarthestView_m = 6;  // range up to which a scene has full resolution
constexpr int kPans = 24;              // of a mast that may look anywhere
constexpr int kMeteredRow = 16;        // auto exposure measures every 16th row
// Odd multiplier (2^64 over the golden ratio): image noise of different noise seeds gets disjoint seeds.
constexpr std::uint64_t kNoiseStride = 0x9E3779B97F4A7C15U;

// Grows the region by the footprint of a camera on level ground at height `ground_m`, up to kFarthestView_m.
void add_footprint(Region& region, const Camera& camera, const Pose& world_from_camera, double ground_m) {
  const auto include = [&](double x, double y) {
    region = {std::min(region.x0, x), std::min(region.y0, y), std::max(region.x1, x), std::max(region.y1, y)};
  };
  const Eigen::Vector3d& centre = world_from_camera.translation();
  include(centre.x(), centre.y());
  constexpr int kSide = 4;
  for (int j = 0; j <= kSide; ++j) {
    for (int i = 0; i <= kSide; ++i) {
      const auto ray =
          unproject(camera.model, {i * (camera.size.width - 1.0) / kSide, j * (camera.size.height - 1.0) / kSide});
      if (!ray) continue;
      const Eigen::Vector3d d = world_from_camera.rotation() * ray->direction;
      const double horizontal = std::hypot(d.x(), d.y());
      if (horizontal < 1e-9) continue;
      const double reach = d.z() < 0
                               ? std::min(1.25 * (centre.z() - ground_m) * horizontal / -d.z() + 0.3, kFarthestView_m)
                               : kFarthestView_m;
      include(centre.x() + reach * d.x() / horizontal, centre.y() + reach * d.y() / horizontal);
    }
  }
}

}  // namespace

// Renderers and sensors of one pair of the rig.
struct FrameSimulator::PairRenderer {
  Renderer left, right;
  Sensor left_sensor, right_sensor;
  std::optional<DisparityTruth> truth;
  bool colour;
};

FrameSimulator::FrameSimulator(const SimulationRequest& request, const ThreadPool& workers)
    : request_(request),
      workers_(workers),
      scenario_(request.scenario),
      world_(make_world(request.scenario, request.drive)),
      nominal_(nominal_rig(request.rig, request.scenario.nominal_rig)),
      rig_(true_rig(request.rig, request.scenario.rover_errors, request.scenario.seed)),
      geometry_(rig_, request.scenario,
                BodyMotion(request.drive, {world_.shape, world_.wheel_lift}, request.scenario.chassis, workers,
                           request.scenario.wheels)) {
  if (scenario_.chassis.track_depth_m > 0) driven_poses_ = poses_of_wheel_tracks();
  rig_.calibration_errors = CalibrationErrors{0, 0, 0, 0, 0};
  // A calibration that is wrong does not know of it.
  if (scenario_.nominal_rig == NominalRigOptions())
    nominal_.calibration_errors = calibration_errors(scenario_.rover_errors);
  nominal_.rover.track_m = request.scenario.chassis.track_m;
  nominal_.rover.wheel_radius_m = request.scenario.chassis.wheel_radius_m;
  if (scenario_.sensor.vignetting_stated) {
    for (Camera& camera : nominal_.cameras) camera.vignetting = fitted_vignetting(camera, scenario_.sensor.vignetting);
  }
  make_pair_renderers();
}

FramePreview FrameSimulator::preview_left(std::size_t i) const {
  const PlannedFrame& planned = request_.drive.frames()[i];
  const StereoPair& pair = *rig_.find_pair(planned.pair);
  const Camera& camera = *rig_.find_camera(pair.left);
  const Renderer renderer(camera, Sampling::of(scenario_.samples));
  const Sensor sensor(scenario_.sensor, camera);
  const SceneAround around = scene_around(i, i + 1, std::nullopt);
  const std::optional<RoverBody> rover = geometry_.visible_rover(planned);
  FramePreview preview;
  preview.exposure = choose_exposure(
      scenario_.sensor,
      renderer.mean_luminance(around.lit(), geometry_.exposing(planned, pair.left, 0, rover), kMeteredRow));
  Stopwatch watch;
  const LuminanceImage luminance = renderer.render(
      around.lit(), geometry_.exposing(planned, pair.left, preview.exposure.seconds, rover), true, workers_);
  preview.seconds = 1e-3 * watch.lap();
  preview.rays = renderer.rays();
  preview.recorded = sensor.expose(luminance, preview.exposure, {}, 1, workers_);
  preview.noise_free = sensor.noise_free(luminance, preview.exposure);
  preview.soil = Image<std::uint8_t>(camera.size.width, camera.size.height);
  for (int y = 0; y < camera.size.height; ++y) {
    for (int x = 0; x < camera.size.width; ++x)
      preview.soil(x, y) = luminance.by_material[0](x, y) > 0.9999F * luminance.total(x, y) ? 255 : 0;
  }
  return preview;
}

SensorIdentity FrameSimulator::identity_of(const Camera& camera) const {
  const std::uint64_t seed = rover_seed(scenario_.rover_errors, scenario_.seed);
  const auto number = static_cast<std::uint64_t>(&camera - rig_.cameras.data());
  return {camera_gain(rig_, camera.name, scenario_.rover_errors, scenario_.seed), seed + (number + 1) * kNoiseStride};
}

void FrameSimulator::make_pair_renderers() {
  const Sampling sampling = Sampling::of(scenario_.samples);
  for (const StereoPair& pair : rig_.pairs) {
    const Camera &left = *rig_.find_camera(pair.left), &right = *rig_.find_camera(pair.right);
    auto tools = std::make_shared<PairRenderer>(PairRenderer{
        Renderer(left, sampling), Renderer(right, sampling), Sensor(scenario_.sensor, left, identity_of(left)),
        Sensor(scenario_.sensor, right, identity_of(right)), std::nullopt,
        left.pixel_format.is_bayer() || right.pixel_format.is_bayer()});
    const auto view = request_.views.find(pair.name);
    if (scenario_.truth.disparity && view != request_.views.end())
      tools->truth.emplace(rig_, nominal_, pair, view->second);
    pair_renderers_.emplace(pair.name, std::move(tools));
  }
}

std::vector<DrivenPose> FrameSimulator::poses_of_wheel_tracks() const {
  const auto pose_at = [&](double time_s) {
    const Pose body = geometry_.motion().world_from_body(time_s);
    return PlanarPose{body.translation().x(), body.translation().y(), geometry_.motion().roll_pitch_yaw(time_s).z()};
  };
  return driven_poses(pose_at, geometry_.motion().seconds(), scenario_.chassis, WheelTracks::kStep_m);
}

std::size_t FrameSimulator::end_of_scene(std::size_t from) const {
  const auto& frames = request_.drive.frames();
  const PlanarPose start = request_.drive.at(frames[from].time_s);
  std::size_t to = from;
  while (to < frames.size()) {
    const PlanarPose at = request_.drive.at(frames[to].time_s);
    if (std::hypot(at.x - start.x, at.y - start.y) > kSceneRadius_m) break;
    ++to;
  }
  return to;
}

const SceneAround& FrameSimulator::scene_of(std::size_t i, std::optional<double> round_tilt_rad) {
  if (i < scene_.from) scene_ = {};
  while (i >= scene_.to) scene_ = {scene_.to, end_of_scene(scene_.to), std::nullopt, nullptr};
  if (!scene_.around || (round_tilt_rad && scene_.round_tilt_rad != round_tilt_rad)) {
    scene_.around = nullptr;  // its memory first
    scene_.around = std::make_unique<SceneAround>(scene_around(scene_.from, scene_.to, round_tilt_rad));
    scene_.round_tilt_rad = round_tilt_rad;
  }
  return *scene_.around;
}

SceneAround FrameSimulator::scene_around(std::size_t from, std::size_t to, std::optional<double> round_tilt_rad) const {
  const Region region = region_of(from, to, round_tilt_rad);
  std::shared_ptr<const WheelTracks> tracks;
  if (scenario_.chassis.track_depth_m > 0) {
    tracks = std::make_shared<const WheelTracks>(driven_poses_, request_.drive.frames()[from].time_s, scenario_.chassis,
                                                 region);
  }
  return {world_, region, tracks, workers_};
}

Region FrameSimulator::region_of(std::size_t from, std::size_t to, std::optional<double> round_tilt_rad) const {
  const PlanarPose start = request_.drive.at(request_.drive.frames()[from].time_s);
  Region region{start.x, start.y, start.x, start.y};
  for (std::size_t i = from; i < to; ++i) {
    const PlannedFrame& planned = request_.drive.frames()[i];
    const double ground = geometry_.motion().world_from_body(planned.time_s).translation().z();
    const auto add = [&](const PlannedFrame& frame) {
      const StereoPair& pair = *rig_.find_pair(frame.pair);
      for (const std::string& name : {pair.left, pair.right})
        add_footprint(region, *rig_.find_camera(name), geometry_.camera_pose(frame, name, frame.time_s), ground);
    };
    add(planned);
    if (!round_tilt_rad) continue;
    PlannedFrame turned = planned;
    turned.tilt_rad = *round_tilt_rad;
    for (const StereoPair& moved : rig_.pairs) {
      if (rig_.find_camera(moved.left)->mount == "body") continue;
      turned.pair = moved.name;
      for (int pan = 0; pan < kPans; ++pan) {
        turned.pan_rad = 2 * std::numbers::pi * pan / kPans;
        add(turned);
      }
    }
  }
  return region.grown(0.3);
}

Stamp FrameSimulator::left_stamp(std::size_t i, const FrameFaultState& fault) const {
  return stamp_at(request_.drive.frames()[i].time_s + fault.left_jitter_s);
}

FrameFaultState FrameSimulator::fault_at(std::size_t i) const {
  const PlannedFrame& planned = request_.drive.frames()[i];
  return fault_state(scenario_.camera_faults, planned.pair, planned.time_s, i,
                     static_cast<std::uint64_t>(scenario_.seed));
}

// The frame whose light auto exposure measures.
const PlannedFrame& FrameSimulator::metered_frame(std::size_t i) const {
  const auto& frames = request_.drive.frames();
  for (std::size_t before = i; scenario_.sensor.meter_lags && before-- > 0;) {
    if (frames[before].pair == frames[i].pair) return frames[before];
  }
  return frames[i];
}

// By the rule of the scenario.
Exposure FrameSimulator::exposure_for(const PlannedFrame& metered, const LitScene& lit) const {
  const PairRenderer& tools = *pair_renderers_.at(metered.pair);
  const std::optional<RoverBody> rover = geometry_.visible_rover(metered);
  const Exposing metering = geometry_.exposing(metered, rig_.find_pair(metered.pair)->left, 0, rover);
  return choose_exposure(scenario_.sensor, tools.left.mean_luminance(lit, metering, kMeteredRow));
}

SimulatedFrame FrameSimulator::render(std::size_t i, const FrameFaultState& fault, const FrameCommands& commands) {
  PlannedFrame planned = request_.drive.frames()[i];
  if (commands.trigger) {
    planned.pair = commands.trigger->pair;
    planned.time_s = commands.trigger->time_s;
  }
  if (commands.angles) {
    planned.pan_rad = commands.angles->pan_rad;
    planned.tilt_rad = commands.angles->tilt_rad;
  }
  const std::size_t number = commands.trigger ? commands.trigger->number : i;
  const PairRenderer& tools = *pair_renderers_.at(planned.pair);
  const StereoPair& pair = *rig_.find_pair(planned.pair);
  const auto round_tilt = commands.angles ? std::optional(commands.angles->tilt_rad) : std::nullopt;
  const LitScene lit = scene_of(i, round_tilt).lit();
  const std::optional<RoverBody> rover = geometry_.visible_rover(planned);
  const Exposure exposure =
      commands.exposure ? *commands.exposure : exposure_for(commands.trigger ? planned : metered_frame(i), lit);
  const auto seed = static_cast<std::uint64_t>(scenario_.seed) * 1000003 + 2 * number +
                    static_cast<std::uint64_t>(scenario_.sensor.noise_seed) * kNoiseStride;
  SimulatedFrame result;
  StereoFrame& frame = result.frame;
  frame.frame_id = static_cast<std::int64_t>(number);
  frame.position_id = planned.position_id;
  frame.pair = planned.pair;
  frame.left_stamp = stamp_at(planned.time_s + fault.left_jitter_s);
  frame.right_stamp = stamp_at(planned.time_s + fault.right_jitter_s);
  frame.pan_rad = planned.pan_rad;
  frame.tilt_rad = planned.tilt_rad;
  frame.exposure_us = exposure.seconds * 1e6;
  frame.gain = exposure.gain;
  const auto render = [&](const Renderer& renderer, const std::string& camera) {
    return renderer.render(lit, geometry_.exposing(planned, camera, exposure.seconds, rover), tools.colour, workers_);
  };
  const LuminanceImage left = render(tools.left, pair.left), right = render(tools.right, pair.right);
  frame.left = tools.left_sensor.expose(left, exposure, fault.left, seed, workers_);
  frame.right = tools.right_sensor.expose(right, exposure, fault.right, seed + 1, workers_);
  if (tools.truth) result.truth = tools.truth->of(lit.scene, geometry_.pair_poses(planned, pair, rover), workers_);
  rays_ += tools.left.rays() + tools.right.rays();
  return result;
}

FramePreview preview_left(const SimulationRequest& request, std::size_t frame_index, const ThreadPool& workers) {
  return FrameSimulator(request, workers).preview_left(frame_index);
}

}  // namespace spartan::sim::internal
