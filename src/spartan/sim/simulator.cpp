#include "spartan/sim/simulator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "spartan/camera/recording_writer.h"
#include "spartan/core/files.h"
#include "spartan/core/stage_clock.h"
#include "spartan/sim/internal/camera/faults.h"
#include "spartan/sim/internal/camera/frame_geometry.h"
#include "spartan/sim/internal/camera/frame_preview.h"
#include "spartan/sim/internal/camera/renderer.h"
#include "spartan/sim/internal/camera/rover_body.h"
#include "spartan/sim/internal/camera/scene_around.h"
#include "spartan/sim/internal/camera/truth.h"
#include "spartan/sim/internal/drive/body_motion.h"
#include "spartan/sim/internal/drive/driven_poses.h"
#include "spartan/sim/internal/drive/motion_sensors.h"
#include "spartan/sim/internal/drive/rover_seed.h"
#include "spartan/sim/internal/world/wheel_tracks.h"
#include "spartan/sim/internal/world/world.h"
#include "spartan/storage/geotiff.h"

namespace spartan::sim {

using namespace internal;

namespace {

namespace fs = std::filesystem;

constexpr double kSceneRadius_m = 2;   // frames within this distance of the first one share a scene
constexpr double kFarthestView_m = 6;  // range up to which a scene has full resolution
constexpr double kMapMargin_m = 5;     // of the true maps around the track
constexpr int kMeteredRow = 16;        // auto exposure measures every 16th row
// Odd multiplier (2^64 over the golden ratio): image noise of different noise seeds gets disjoint seeds.
constexpr std::uint64_t kNoiseStride = 0x9E3779B97F4A7C15U;
constexpr const char* kScenarioFile = "/truth/scenario.yaml";

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

Status write_maps(const SimulationRequest& request, const World& world, const ThreadPool& workers) {
  const std::string folder = request.folder + "/truth";
  const Region region = bounds_of(request.drive.track()).grown(kMapMargin_m);
  std::string rocks = "x_m,y_m,diameter_m,height_m\n";
  for (const Rock& rock : world.rocks.rocks_in(region, RockField::kLargestPebble_m))
    rocks += fmt::format("{:.4f},{:.4f},{:.4f},{:.4f}\n", rock.x, rock.y, rock.diameter_m, rock.height_m);
  if (Status s = write_file_atomically(folder + "/rocks.csv", rocks); !s) return s;

  const TruthOptions& truth = request.scenario.truth;
  const GroundMap map = map_ground(world.shape, world.rocks, region, truth.cell_m, workers);
  const GeoTransform place{map.west_m, map.north_m, map.cell_m};
  if (Status s = write_geotiff(folder + "/elevation.tif", place,
                               {{"elevation_m", map.surface.view()}, {"ground_m", map.ground.view()}});
      !s)
    return s;
  const auto [w, h] = map.surface.size();
  Image<float> above(w, h);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) above(x, y) = map.surface(x, y) - map.level(x, y);
  }
  const Image<float> kinds = classify_ground(map, truth.obstacle_m, truth.cavity_m);
  return write_geotiff(folder + "/obstacles.tif", place, {{"class", kinds.view()}, {"height_m", above.view()}});
}

// Renderers and sensors of one pair of the rig.
struct PairRenderer {
  Renderer left, right;
  Sensor left_sensor, right_sensor;
  std::optional<DisparityTruth> truth;
  bool colour;
};

class Simulation {
 public:
  Simulation(const SimulationRequest& request, const SimulationHooks& hooks, const ThreadPool& workers)
      : request_(request),
        hooks_(hooks),
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
      for (Camera& camera : nominal_.cameras)
        camera.vignetting = fitted_vignetting(camera, scenario_.sensor.vignetting);
    }
  }

  Result<SimulationReport> run() {
    const RecordingOptions about{scenario_.name, scenario_.description, scenario_.gravity_m_s2,
                                 specified_noise(scenario_.imu, scenario_.compass, scenario_.inclinometer)};
    if (Status s = check_folder(); !s) return failure(s);
    auto writer = request_.resume ? RecordingWriter::resume(request_.folder, nominal_, about)
                                  : RecordingWriter::create(request_.folder, nominal_, about);
    if (!writer) return failure(writer);
    if (Status s = make_folder(request_.folder + "/truth"); !s) return failure(s);
    if (Status s = write_file_atomically(request_.folder + kScenarioFile, dump_options(scenario_)); !s)
      return failure(s);
    make_pair_renderers();
    const auto& frames = request_.drive.frames();
    for (std::size_t from = 0; from < frames.size();) {
      const std::size_t to = end_of_scene(from);
      if (Status s = render_scene_frames(*writer, from, to); !s) return failure(s);
      if (report_.interrupted) return report_;
      from = to;
    }
    if (Status s = finish_recording(*writer); !s) return failure(s);
    return report_;
  }

  FramePreview preview_left(std::size_t i) {
    const PlannedFrame& planned = request_.drive.frames()[i];
    const StereoPair& pair = *rig_.find_pair(planned.pair);
    const Camera& camera = *rig_.find_camera(pair.left);
    const Renderer renderer(camera, Sampling::of(scenario_.samples));
    const Sensor sensor(scenario_.sensor, camera);
    const SceneAround around = scene_around(i, i + 1);
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

 private:
  // A folder to resume must hold the same scenario. Compares the values, so that a change of the comments or the key
  // names of scenario.yaml between versions does not matter.
  Status check_folder() const {
    if (!request_.resume) return {};
    const auto text = read_file(request_.folder + kScenarioFile);
    if (!text) return {};
    const auto before = parse_options<Scenario>(*text, kScenarioFile);
    if (!before || dump_options(*before) != dump_options(scenario_)) {
      return failure(ErrorCode::configuration, "was started with another scenario or seed", request_.folder,
                     "resume with the same scenario and seed, or choose another folder");
    }
    return {};
  }

  SensorIdentity identity_of(const Camera& camera) const {
    const std::uint64_t seed = rover_seed(scenario_.rover_errors, scenario_.seed);
    const auto number = static_cast<std::uint64_t>(&camera - rig_.cameras.data());
    return {camera_gain(rig_, camera.name, scenario_.rover_errors, scenario_.seed), seed + (number + 1) * kNoiseStride};
  }

  void make_pair_renderers() {
    const Sampling sampling = Sampling::of(scenario_.samples);
    for (const StereoPair& pair : rig_.pairs) {
      const Camera &left = *rig_.find_camera(pair.left), &right = *rig_.find_camera(pair.right);
      PairRenderer tools{Renderer(left, sampling),
                         Renderer(right, sampling),
                         Sensor(scenario_.sensor, left, identity_of(left)),
                         Sensor(scenario_.sensor, right, identity_of(right)),
                         std::nullopt,
                         left.pixel_format.is_bayer() || right.pixel_format.is_bayer()};
      const auto view = request_.views.find(pair.name);
      if (scenario_.truth.disparity && view != request_.views.end())
        tools.truth.emplace(rig_, nominal_, pair, view->second);
      pair_renderers_.emplace(pair.name, std::move(tools));
    }
  }

  std::vector<DrivenPose> poses_of_wheel_tracks() const {
    const auto pose_at = [&](double time_s) {
      const Pose body = geometry_.motion().world_from_body(time_s);
      return PlanarPose{body.translation().x(), body.translation().y(), geometry_.motion().roll_pitch_yaw(time_s).z()};
    };
    return driven_poses(pose_at, geometry_.motion().seconds(), scenario_.chassis, WheelTracks::kStep_m);
  }

  std::size_t end_of_scene(std::size_t from) const {
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

  SceneAround scene_around(std::size_t from, std::size_t to) const {
    const Region region = region_of(from, to);
    std::shared_ptr<const WheelTracks> tracks;
    if (scenario_.chassis.track_depth_m > 0) {
      tracks = std::make_shared<const WheelTracks>(driven_poses_, request_.drive.frames()[from].time_s,
                                                   scenario_.chassis, region);
    }
    return {world_, region, tracks, workers_};
  }

  Region region_of(std::size_t from, std::size_t to) const {
    const PlanarPose start = request_.drive.at(request_.drive.frames()[from].time_s);
    Region region{start.x, start.y, start.x, start.y};
    for (std::size_t i = from; i < to; ++i) {
      const PlannedFrame& planned = request_.drive.frames()[i];
      const StereoPair& pair = *rig_.find_pair(planned.pair);
      const double ground = geometry_.motion().world_from_body(planned.time_s).translation().z();
      for (const std::string& name : {pair.left, pair.right}) {
        add_footprint(region, *rig_.find_camera(name), geometry_.camera_pose(planned, name, planned.time_s), ground);
      }
    }
    return region.grown(0.3);
  }

  Stamp left_stamp(std::size_t i, const FrameFaultState& fault) const {
    return stamp_at(request_.drive.frames()[i].time_s + fault.left_jitter_s);
  }

  FrameFaultState fault_at(std::size_t i) const {
    const PlannedFrame& planned = request_.drive.frames()[i];
    return fault_state(scenario_.camera_faults, planned.pair, planned.time_s, i,
                       static_cast<std::uint64_t>(scenario_.seed));
  }

  Status render_scene_frames(RecordingWriter& writer, std::size_t from, std::size_t to) {
    std::optional<SceneAround> around;
    for (std::size_t i = from; i < to; ++i) {
      if (hooks_.should_stop && hooks_.should_stop()) {
        report_.interrupted = true;
        return {};
      }
      const PlannedFrame& planned = request_.drive.frames()[i];
      const FrameFaultState fault = fault_at(i);
      if (!fault.dropped) {
        const auto kept = writer.reuse_frame(planned.pair, left_stamp(i, fault));
        if (!kept) return failure(kept);
        if (!*kept) {
          if (!around) around.emplace(scene_around(from, to));
          if (Status s = render_frame(writer, i, around->lit(), fault); !s) return s;
        }
        poses_.push_back({left_stamp(i, fault), geometry_.motion().world_from_body(planned.time_s)});
        ++report_.frames;
      }
      if (hooks_.progress) hooks_.progress({static_cast<int>(i) + 1, static_cast<int>(request_.drive.frames().size())});
    }
    return {};
  }

  // The frame whose light auto exposure measures.
  const PlannedFrame& metered_frame(std::size_t i) const {
    const auto& frames = request_.drive.frames();
    for (std::size_t before = i; scenario_.sensor.meter_lags && before-- > 0;) {
      if (frames[before].pair == frames[i].pair) return frames[before];
    }
    return frames[i];
  }

  Status render_frame(RecordingWriter& writer, std::size_t i, const LitScene& lit, const FrameFaultState& fault) {
    Stopwatch watch;
    const PlannedFrame& planned = request_.drive.frames()[i];
    const PairRenderer& tools = pair_renderers_.at(planned.pair);
    const StereoPair& pair = *rig_.find_pair(planned.pair);
    const std::optional<RoverBody> rover = geometry_.visible_rover(planned);
    const std::optional<RoverBody> metered_rover = geometry_.visible_rover(metered_frame(i));
    const Exposing metering = geometry_.exposing(metered_frame(i), pair.left, 0, metered_rover);
    const Exposure exposure = choose_exposure(scenario_.sensor, tools.left.mean_luminance(lit, metering, kMeteredRow));
    const auto seed = static_cast<std::uint64_t>(scenario_.seed) * 1000003 + 2 * i +
                      static_cast<std::uint64_t>(scenario_.sensor.noise_seed) * kNoiseStride;
    StereoFrame frame;
    frame.frame_id = static_cast<std::int64_t>(i);
    frame.position_id = planned.position_id;
    frame.pair = planned.pair;
    frame.left_stamp = left_stamp(i, fault);
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
    if (tools.truth) {
      const TrueDisparity truth = tools.truth->of(lit.scene, geometry_.pair_poses(planned, pair, rover), workers_);
      if (Status s =
              writer.write_truth_disparity(planned.pair, frame.left_stamp, truth.disparity.view(), truth.mask.view());
          !s)
        return s;
    }
    report_.rays += tools.left.rays() + tools.right.rays();
    report_.render_seconds += 1e-3 * watch.lap();
    return writer.add(frame);
  }

  template <class Samples>
  static Status add_all(RecordingWriter& writer, const Samples& samples) {
    for (const auto& sample : samples) {
      if (Status s = writer.add(sample); !s) return s;
    }
    return {};
  }

  Status finish_recording(RecordingWriter& writer) {
    const auto seed = static_cast<std::uint64_t>(scenario_.seed);
    const SensorFaults& faults = scenario_.sensor_faults;
    if (Status s =
            add_all(writer, measure_imu(geometry_.motion(), scenario_.imu, scenario_.gravity_m_s2, faults, seed));
        !s)
      return s;
    if (Status s =
            add_all(writer, measure_wheels(geometry_.motion(), scenario_.chassis, scenario_.wheels, faults, seed));
        !s)
      return s;
    if (Status s = add_all(writer, measure_compass(geometry_.motion(), scenario_.compass, faults, seed)); !s) return s;
    if (Status s = add_all(writer, measure_inclinometer(geometry_.motion(), scenario_.inclinometer, faults, seed)); !s)
      return s;
    // Pairs that take frames at the same time share one pose.
    std::sort(poses_.begin(), poses_.end(),
              [](const StampedPose& a, const StampedPose& b) { return a.stamp < b.stamp; });
    poses_.erase(std::unique(poses_.begin(), poses_.end(),
                             [](const StampedPose& a, const StampedPose& b) { return a.stamp == b.stamp; }),
                 poses_.end());
    if (Status s = writer.write_truth(rig_, poses_); !s) return s;
    if (Status s = write_maps(request_, world_, workers_); !s) return s;
    return writer.finish();
  }

  const SimulationRequest& request_;
  const SimulationHooks& hooks_;
  const ThreadPool& workers_;
  const Scenario& scenario_;
  World world_;
  Rig nominal_, rig_;  // as the recording states it; as it is at the start
  FrameGeometry geometry_;
  std::vector<DrivenPose> driven_poses_;  // as close as wheel tracks need; empty: there are none
  std::map<std::string, PairRenderer> pair_renderers_;
  Trajectory poses_;
  SimulationReport report_;
};

}  // namespace

FramePreview internal::preview_left(const SimulationRequest& request, std::size_t frame_index,
                                    const ThreadPool& workers) {
  const SimulationHooks hooks;
  return Simulation(request, hooks, workers).preview_left(frame_index);
}

Result<SimulationReport> simulate(const SimulationRequest& request, const SimulationHooks& hooks,
                                  const ThreadPool& workers) {
  if (Status valid = validate(request.scenario, "scenario"); !valid) return failure(valid);
  return Simulation(request, hooks, workers).run();
}

}  // namespace spartan::sim
