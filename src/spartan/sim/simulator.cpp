#include "spartan/sim/simulator.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "spartan/camera/recording_writer.h"
#include "spartan/core/files.h"
#include "spartan/core/geotiff.h"
#include "spartan/sim/renderer.h"

namespace spartan::sim {
namespace {

namespace fs = std::filesystem;

constexpr double kPlace_m = 2;  // shots so near each other share a scene
constexpr double kFarthestView_m = 6;
constexpr double kMapMargin_m = 5;
constexpr int kMeteredRow = 16;
constexpr std::uint64_t kNoiseStride = 0x9E3779B97F4A7C15U;  // odd: seeds of no two noises meet
constexpr const char* kScenarioFile = "/truth/scenario.yaml";

// Places on level ground under the body that a camera sees, not farther than kFarthestView_m.
void add_view(Region& region, const Camera& camera, const Pose& world_from_camera, double ground_m) {
  const auto include = [&](double x, double y) {
    region = {std::min(region.x0, x), std::min(region.y0, y), std::max(region.x1, x), std::max(region.y1, y)};
  };
  const Eigen::Vector3d& eye = world_from_camera.translation();
  include(eye.x(), eye.y());
  constexpr int kSide = 4;
  for (int j = 0; j <= kSide; ++j) {
    for (int i = 0; i <= kSide; ++i) {
      const auto ray =
          unproject(camera.model, {i * (camera.size.width - 1.0) / kSide, j * (camera.size.height - 1.0) / kSide});
      if (!ray) continue;
      const Eigen::Vector3d d = world_from_camera.rotation() * ray->direction;
      const double level = std::hypot(d.x(), d.y());
      if (level < 1e-9) continue;
      const double reach =
          d.z() < 0 ? std::min(1.25 * (eye.z() - ground_m) * level / -d.z() + 0.3, kFarthestView_m) : kFarthestView_m;
      include(eye.x() + reach * d.x() / level, eye.y() + reach * d.y() / level);
    }
  }
}

Region bounds_of(const std::vector<PlanarPose>& track) {
  Region region{track.front().x, track.front().y, track.front().x, track.front().y};
  for (const PlanarPose& p : track)
    region = {std::min(region.x0, p.x), std::min(region.y0, p.y), std::max(region.x1, p.x), std::max(region.y1, p.y)};
  return region;
}

Status write_maps(const SimulationRequest& request, const World& world, const Workers& workers) {
  const std::string folder = request.folder + "/truth";
  const Region region = bounds_of(request.drive.track()).grown(kMapMargin_m);
  std::string rocks = "x_m,y_m,diameter_m,height_m\n";
  for (const Rock& rock : world.rocks.rocks_between(region, RockField::kLargestPebble_m))
    rocks += fmt::format("{:.4f},{:.4f},{:.4f},{:.4f}\n", rock.x, rock.y, rock.diameter_m, rock.height_m);
  if (Status s = write_file_atomically(folder + "/rocks.csv", rocks); !s) return s;

  const TruthOptions& truth = request.scenario.truth;
  const GroundMap map = map_ground(world.shape, world.rocks, region, truth.cell_m, workers);
  const MapPlace place{map.west_m, map.north_m, map.cell_m};
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

// Everything that belongs to one pair of the rig.
struct PairTools {
  Renderer left, right;
  Sensor left_sensor, right_sensor;
  std::optional<DisparityTruth> truth;
  bool colour;
};

class Simulation {
 public:
  Simulation(const SimulationRequest& request, const SimulationHooks& hooks, const Workers& workers)
      : request_(request),
        hooks_(hooks),
        workers_(workers),
        scenario_(request.scenario),
        world_(make_world(request.scenario, request.drive)),
        motion_(request.drive, {world_.shape, world_.wheel_lift}, request.scenario.chassis, workers),
        believed_(believed_rig(request.rig, request.scenario.believed)) {}

  Result<SimulationReport> run() {
    const RecordingOptions about{scenario_.name, scenario_.description, scenario_.gravity_m_s2,
                                 stated_noise(scenario_.imu, scenario_.compass, scenario_.inclinometer)};
    if (Status s = check_folder(); !s) return failure(s);
    auto writer = request_.resume ? RecordingWriter::resume(request_.folder, believed_, about)
                                  : RecordingWriter::create(request_.folder, believed_, about);
    if (!writer) return failure(writer);
    if (Status s = make_folder(request_.folder + "/truth"); !s) return failure(s);
    if (Status s = write_file_atomically(request_.folder + kScenarioFile, dump_options(scenario_)); !s)
      return failure(s);
    make_tools();
    const auto& shots = request_.drive.shots();
    for (std::size_t from = 0; from < shots.size();) {
      const std::size_t to = end_of_place(from);
      if (Status s = shoot_place(*writer, from, to); !s) return failure(s);
      if (report_.interrupted) return report_;
      from = to;
    }
    if (Status s = write_rest(*writer); !s) return failure(s);
    return report_;
  }

  ShotPreview preview_left(std::size_t i) {
    const Shot& shot = request_.drive.shots()[i];
    const StereoPair& pair = *request_.rig.find_pair(shot.pair);
    const Camera& camera = *request_.rig.find_camera(pair.left);
    const Renderer renderer(camera, Sampling::of(scenario_.samples));
    const Sensor sensor(scenario_.sensor, camera);
    const GroundScene scene(world_.shape, world_.rocks, region_of(i, i + 1), workers_);
    const SkyLight sky(scene, world_.shape, workers_);
    const Surroundings around{scene, sky, world_.sun, world_.soil, world_.sky_lux};
    const Pose pose = camera_pose(shot, pair.left, shot.time_s);
    ShotPreview preview;
    preview.exposure = choose_exposure(scenario_.sensor, renderer.metered(around, pose, kMeteredRow));
    const auto start = std::chrono::steady_clock::now();
    const Radiance radiance =
        renderer.render(around, exposure_poses(shot, pair.left, preview.exposure.seconds), true, workers_);
    preview.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    preview.rays = renderer.rays();
    preview.recorded = sensor.expose(radiance, preview.exposure, {}, 1, workers_);
    preview.noise_free = sensor.noise_free(radiance, preview.exposure);
    preview.soil = Image<std::uint8_t>(camera.size.width, camera.size.height);
    for (int y = 0; y < camera.size.height; ++y) {
      for (int x = 0; x < camera.size.width; ++x)
        preview.soil(x, y) = radiance.by_material[0](x, y) > 0.9999F * radiance.total(x, y) ? 255 : 0;
    }
    return preview;
  }

 private:
  // A folder that is resumed must hold this scenario.
  Status check_folder() const {
    if (!request_.resume) return {};
    const auto before = read_file(request_.folder + kScenarioFile);
    if (before && *before != dump_options(scenario_)) {
      return failure(ErrorCode::configuration, "was begun with another scenario or seed", request_.folder,
                     "resume with the same one, or give another folder");
    }
    return {};
  }

  void make_tools() {
    const Sampling sampling = Sampling::of(scenario_.samples);
    for (const StereoPair& pair : request_.rig.pairs) {
      const Camera &left = *request_.rig.find_camera(pair.left), &right = *request_.rig.find_camera(pair.right);
      PairTools tools{Renderer(left, sampling),
                      Renderer(right, sampling),
                      Sensor(scenario_.sensor, left),
                      Sensor(scenario_.sensor, right),
                      std::nullopt,
                      left.pixel_format.is_bayer() || right.pixel_format.is_bayer()};
      const auto view = request_.views.find(pair.name);
      if (scenario_.truth.disparity && view != request_.views.end())
        tools.truth.emplace(request_.rig, believed_, pair, view->second);
      tools_.emplace(pair.name, std::move(tools));
    }
  }

  std::size_t end_of_place(std::size_t from) const {
    const auto& shots = request_.drive.shots();
    const PlanarPose start = request_.drive.at(shots[from].time_s);
    std::size_t to = from;
    while (to < shots.size()) {
      const PlanarPose at = request_.drive.at(shots[to].time_s);
      if (std::hypot(at.x - start.x, at.y - start.y) > kPlace_m) break;
      ++to;
    }
    return to;
  }

  Pose camera_pose(const Shot& shot, const std::string& camera, double time_s) const {
    return motion_.world_from_body(time_s) * request_.rig.body_from_camera(camera, shot.pan_rad, shot.tilt_rad);
  }

  Region region_of(std::size_t from, std::size_t to) const {
    const PlanarPose start = request_.drive.at(request_.drive.shots()[from].time_s);
    Region region{start.x, start.y, start.x, start.y};
    for (std::size_t i = from; i < to; ++i) {
      const Shot& shot = request_.drive.shots()[i];
      const StereoPair& pair = *request_.rig.find_pair(shot.pair);
      const double ground = motion_.world_from_body(shot.time_s).translation().z();
      for (const std::string& name : {pair.left, pair.right}) {
        add_view(region, *request_.rig.find_camera(name), camera_pose(shot, name, shot.time_s), ground);
      }
    }
    return region.grown(0.3);
  }

  Stamp left_stamp(std::size_t i, const ShotFault& fault) const {
    return stamp_at(request_.drive.shots()[i].time_s + fault.left_jitter_s);
  }

  ShotFault fault(std::size_t i) const {
    const Shot& shot = request_.drive.shots()[i];
    return fault_of(scenario_.camera_faults, shot.pair, shot.time_s, i, static_cast<std::uint64_t>(scenario_.seed));
  }

  Status shoot_place(RecordingWriter& writer, std::size_t from, std::size_t to) {
    std::optional<GroundScene> scene;
    std::optional<SkyLight> sky;
    for (std::size_t i = from; i < to; ++i) {
      if (hooks_.should_stop && hooks_.should_stop()) {
        report_.interrupted = true;
        return {};
      }
      const Shot& shot = request_.drive.shots()[i];
      const ShotFault wrong = fault(i);
      if (!wrong.dropped) {
        const auto there = writer.take_over(shot.pair, left_stamp(i, wrong));
        if (!there) return failure(there);
        if (!*there) {
          if (!scene) {
            scene.emplace(world_.shape, world_.rocks, region_of(from, to), workers_);
            sky.emplace(*scene, world_.shape, workers_);
          }
          const Surroundings around{*scene, *sky, world_.sun, world_.soil, world_.sky_lux};
          if (Status s = shoot(writer, i, around, wrong); !s) return s;
        }
        poses_.push_back({left_stamp(i, wrong), motion_.world_from_body(shot.time_s)});
        ++report_.frames;
      }
      if (hooks_.progress) hooks_.progress({static_cast<int>(i) + 1, static_cast<int>(request_.drive.shots().size())});
    }
    return {};
  }

  Renderer::Poses exposure_poses(const Shot& shot, const std::string& camera, double seconds) const {
    Renderer::Poses poses;
    for (std::size_t t = 0; t < poses.size(); ++t) {
      const double part = (static_cast<double>(t) + 0.5) / Renderer::kTimes - 0.5;
      poses[t] = camera_pose(shot, camera, shot.time_s + part * seconds);
    }
    return poses;
  }

  Status shoot(RecordingWriter& writer, std::size_t i, const Surroundings& around, const ShotFault& wrong) {
    const auto start = std::chrono::steady_clock::now();
    const Shot& shot = request_.drive.shots()[i];
    const PairTools& tools = tools_.at(shot.pair);
    const StereoPair& pair = *request_.rig.find_pair(shot.pair);
    const Pose left_pose = camera_pose(shot, pair.left, shot.time_s);
    const Exposure exposure = choose_exposure(scenario_.sensor, tools.left.metered(around, left_pose, kMeteredRow));
    const auto seed = static_cast<std::uint64_t>(scenario_.seed) * 1000003 + 2 * i +
                      static_cast<std::uint64_t>(scenario_.sensor.noise_seed) * kNoiseStride;
    StereoFrame frame;
    frame.frame_id = static_cast<std::int64_t>(i);
    frame.position_id = shot.position_id;
    frame.pair = shot.pair;
    frame.left_stamp = left_stamp(i, wrong);
    frame.right_stamp = stamp_at(shot.time_s + wrong.right_jitter_s);
    frame.pan_rad = shot.pan_rad;
    frame.tilt_rad = shot.tilt_rad;
    frame.exposure_us = exposure.seconds * 1e6;
    frame.gain = exposure.gain;
    const Radiance left =
        tools.left.render(around, exposure_poses(shot, pair.left, exposure.seconds), tools.colour, workers_);
    const Radiance right =
        tools.right.render(around, exposure_poses(shot, pair.right, exposure.seconds), tools.colour, workers_);
    frame.left = tools.left_sensor.expose(left, exposure, wrong.left, seed, workers_);
    frame.right = tools.right_sensor.expose(right, exposure, wrong.right, seed + 1, workers_);
    if (tools.truth) {
      const TrueDisparity truth = tools.truth->of(around.scene, left_pose, workers_);
      if (Status s =
              writer.write_truth_disparity(shot.pair, frame.left_stamp, truth.disparity.view(), truth.mask.view());
          !s)
        return s;
    }
    report_.rays += tools.left.rays() + tools.right.rays();
    report_.render_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return writer.add(frame);
  }

  template <class Samples>
  static Status add_all(RecordingWriter& writer, const Samples& samples) {
    for (const auto& sample : samples) {
      if (Status s = writer.add(sample); !s) return s;
    }
    return {};
  }

  Status write_rest(RecordingWriter& writer) {
    const auto seed = static_cast<std::uint64_t>(scenario_.seed);
    const SensorFaults& faults = scenario_.sensor_faults;
    if (Status s = add_all(writer, measure_imu(motion_, scenario_.imu, scenario_.gravity_m_s2, faults, seed)); !s)
      return s;
    if (Status s = add_all(writer, measure_wheels(motion_, scenario_.chassis, scenario_.wheels, faults, seed)); !s)
      return s;
    if (Status s = add_all(writer, measure_heading(motion_, scenario_.compass, faults, seed)); !s) return s;
    if (Status s = add_all(writer, measure_tilt(motion_, scenario_.inclinometer, faults, seed)); !s) return s;
    // Pairs that look at the same moment give one pose.
    std::sort(poses_.begin(), poses_.end(),
              [](const StampedPose& a, const StampedPose& b) { return a.stamp < b.stamp; });
    poses_.erase(std::unique(poses_.begin(), poses_.end(),
                             [](const StampedPose& a, const StampedPose& b) { return a.stamp == b.stamp; }),
                 poses_.end());
    if (Status s = writer.write_truth(request_.rig, poses_); !s) return s;
    if (Status s = write_maps(request_, world_, workers_); !s) return s;
    return writer.finish();
  }

  const SimulationRequest& request_;
  const SimulationHooks& hooks_;
  const Workers& workers_;
  const Scenario& scenario_;
  World world_;
  BodyMotion motion_;
  Rig believed_;
  std::map<std::string, PairTools> tools_;
  Trajectory poses_;
  SimulationReport report_;
};

}  // namespace

World make_world(const Scenario& scenario, const Drive& drive) {
  const auto seed = static_cast<std::uint64_t>(scenario.seed);
  const ChassisOptions& chassis = scenario.chassis;
  const std::vector<PlanarPose> track = drive.track();
  World world{TerrainShape(scenario.terrain, seed),
              RockField(scenario.rocks, seed),
              {},
              Soil(scenario.soil, seed),
              Sun(scenario.light),
              scenario.light.sky_lux};
  world.rocks.keep_off(ClearWay(track, 0.5 * chassis.track_m + 0.1), chassis.clearance_m);
  const double reach = std::hypot(chassis.wheelbase_m, chassis.track_m);
  world.wheel_lift = WheelLift(world.rocks.rocks_between(bounds_of(track).grown(reach), WheelLift::kPressedIn_m),
                               chassis.wheel_radius_m, chassis.wheel_width_m);
  world.shape.set_datum(stand_on({world.shape, world.wheel_lift}, chassis, drive.at(0))[2]);
  return world;
}

ShotPreview preview_left(const SimulationRequest& request, std::size_t shot, const Workers& workers) {
  const SimulationHooks hooks;
  return Simulation(request, hooks, workers).preview_left(shot);
}

Result<SimulationReport> simulate(const SimulationRequest& request, const SimulationHooks& hooks,
                                  const Workers& workers) {
  return Simulation(request, hooks, workers).run();
}

}  // namespace spartan::sim
