#include "spartan/sim/simulator.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "spartan/camera/recording_writer.h"
#include "spartan/core/files.h"
#include "spartan/core/stage_clock.h"
#include "spartan/sim/internal/camera/truth.h"
#include "spartan/sim/internal/drive/motion_sensors.h"
#include "spartan/sim/internal/frame_simulator.h"
#include "spartan/sim/internal/live_simulation.h"
#include "spartan/storage/geotiff.h"

namespace spartan::sim {

using namespace internal;

namespace {

constexpr double kMapMargin_m = 5;  // of the true maps around the track
constexpr const char* kScenarioFile = "/truth/scenario.yaml";

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

class Simulation {
 public:
  Simulation(const SimulationRequest& request, const SimulationHooks& hooks, const ThreadPool& workers)
      : request_(request), hooks_(hooks), workers_(workers), scenario_(request.scenario), frames_(request, workers) {}

  Result<SimulationReport> run() {
    const RecordingOptions about{scenario_.name, scenario_.description, scenario_.gravity_m_s2,
                                 specified_noise(scenario_.imu, scenario_.compass, scenario_.inclinometer)};
    if (Status s = check_folder(); !s) return failure(s);
    auto writer = request_.resume ? RecordingWriter::resume(request_.folder, frames_.nominal(), about)
                                  : RecordingWriter::create(request_.folder, frames_.nominal(), about);
    if (!writer) return failure(writer);
    if (Status s = make_folder(request_.folder + "/truth"); !s) return failure(s);
    if (Status s = write_file_atomically(request_.folder + kScenarioFile, dump_options(scenario_)); !s)
      return failure(s);
    if (Status s = render_frames(*writer); !s) return failure(s);
    if (report_.interrupted) return report_;
    if (Status s = finish_recording(*writer); !s) return failure(s);
    return report_;
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

  Status render_frames(RecordingWriter& writer) {
    const std::vector<PlannedFrame>& frames = request_.drive.frames();
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (hooks_.should_stop && hooks_.should_stop()) {
        report_.interrupted = true;
        return {};
      }
      const FrameFaultState fault = frames_.fault_at(i);
      if (!fault.dropped) {
        const Stamp stamp = frames_.left_stamp(i, fault);
        const auto kept = writer.reuse_frame(frames[i].pair, stamp);
        if (!kept) return failure(kept);
        if (!*kept) {
          if (Status s = render_frame(writer, i, fault); !s) return s;
        }
        poses_.push_back({stamp, frames_.motion().world_from_body(frames[i].time_s)});
        ++report_.frames;
      }
      if (hooks_.progress) hooks_.progress({static_cast<int>(i) + 1, static_cast<int>(frames.size())});
    }
    return {};
  }

  Status render_frame(RecordingWriter& writer, std::size_t i, const FrameFaultState& fault) {
    Stopwatch watch;
    const SimulatedFrame made = frames_.render(i, fault);
    const StereoFrame& frame = made.frame;
    if (made.truth) {
      Status written = writer.write_truth_disparity(frame.pair, frame.left_stamp, made.truth->disparity.view(),
                                                    made.truth->mask.view());
      if (!written) return written;
    }
    report_.rays = frames_.rays();
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
    if (Status s = add_all(writer, measure_imu(frames_.motion(), scenario_.imu, scenario_.gravity_m_s2, faults, seed));
        !s)
      return s;
    if (Status s = add_all(writer, measure_wheels(frames_.motion(), scenario_.chassis, scenario_.wheels, faults, seed));
        !s)
      return s;
    if (Status s = add_all(writer, measure_compass(frames_.motion(), scenario_.compass, faults, seed)); !s) return s;
    if (Status s = add_all(writer, measure_inclinometer(frames_.motion(), scenario_.inclinometer, faults, seed)); !s)
      return s;
    // Pairs that take frames at the same time share one pose.
    std::sort(poses_.begin(), poses_.end(),
              [](const StampedPose& a, const StampedPose& b) { return a.stamp < b.stamp; });
    poses_.erase(std::unique(poses_.begin(), poses_.end(),
                             [](const StampedPose& a, const StampedPose& b) { return a.stamp == b.stamp; }),
                 poses_.end());
    if (Status s = writer.write_truth(frames_.rig(), poses_); !s) return s;
    if (Status s = write_maps(request_, frames_.world(), workers_); !s) return s;
    return writer.finish();
  }

  const SimulationRequest& request_;
  const SimulationHooks& hooks_;
  const ThreadPool& workers_;
  const Scenario& scenario_;
  FrameSimulator frames_;
  Trajectory poses_;
  SimulationReport report_;
};

}  // namespace

Result<SimulationReport> simulate(const SimulationRequest& request, const SimulationHooks& hooks,
                                  const ThreadPool& workers) {
  if (Status valid = validate(request.scenario, "scenario"); !valid) return failure(valid);
  return Simulation(request, hooks, workers).run();
}

Result<std::unique_ptr<SampleStream>> open_live_simulation(SimulationRequest request, double speed,
                                                           const ThreadPool& workers) {
  if (Status valid = validate(request.scenario, "scenario"); !valid) return failure(valid);
  if (!(speed >= 0)) return failure(ErrorCode::usage, fmt::format("speed {} must be positive", speed));
  request.scenario.truth.disparity = false;
  return std::make_unique<LiveSimulation>(std::move(request), speed, workers);
}

}  // namespace spartan::sim
