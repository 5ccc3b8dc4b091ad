// spartan map build: the terrain map of one pair of images, or of one stop of a recording.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "program/interrupt.h"
#include "program/json.h"
#include "program/map.h"
#include "program/recording_arguments.h"
#include "program/run_arguments.h"
#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/recording.h"
#include "spartan/core/files.h"
#include "spartan/core/pose.h"
#include "spartan/core/stage_clock.h"
#include "spartan/image_io/image_io.h"
#include "spartan/imaging/imager.h"
#include "spartan/localization/localizer.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/stop_mapper.h"
#include "spartan/system/map_files.h"

namespace spartan::program {
namespace {

constexpr double kRestSeconds = 1;   // of IMU samples from the first frame of the stop on
constexpr double kMinRange_m = 0.5;  // smallest mapping.merging.max_range_m
constexpr double kHeightTolerance = 0.05, kPitchTolerance_deg = 2;  // ground by the rig against that of the images
constexpr double kReach = 0.75;  // of the side of the map: slightly more than half of its diagonal

struct BuildArguments {
  std::string left, right, output, recording, gravity, config;
  RecordingArguments of_recording;
  std::vector<std::string> set;
  std::optional<std::int64_t> position;
  std::optional<int> frame;
  std::optional<double> extent_m, cell_m;
};

// The frames of one stop, and the attitude of the body there.
struct Stop {
  Rig rig;
  std::string mask_folder;
  std::vector<StereoFrame> frames;
  std::optional<Eigen::Vector3d> up_in_body;
  const char* up_source = "assumed: gravity along the z axis of the body";
};

Result<std::optional<Eigen::Vector3d>> parse_gravity(const std::string& text) {
  if (text.empty()) return std::nullopt;
  std::array<double, 3> g{};
  std::size_t from = 0;
  for (std::size_t i = 0; i < g.size(); ++i) {
    const std::size_t to = i + 1 < g.size() ? text.find(',', from) : text.size();
    const std::string word = to == std::string::npos ? std::string() : text.substr(from, to - from);
    std::size_t used = 0;
    try {
      g[i] = std::stod(word, &used);
    } catch (const std::exception&) {
      used = 0;
    }
    if (used == 0 || used != word.size() || !std::isfinite(g[i])) {
      return failure(ErrorCode::usage, fmt::format("'{}' is not three numbers separated by commas", text), "--gravity",
                     "the direction of gravity in the body frame (x forward, y left, z up), e.g. 0,0,-1");
    }
    from = to + 1;
  }
  const Eigen::Vector3d down(g[0], g[1], g[2]);
  if (down.norm() < 1e-9) return failure(ErrorCode::usage, "the vector is zero", "--gravity", "give e.g. 0,0,-1");
  return Eigen::Vector3d(-down.normalized());
}

Result<Stop> load_pair(const BuildArguments& a) {
  auto left = read_image(a.left);
  if (!left) return failure(left);
  auto right = read_image(a.right);
  if (!right) return failure(right);
  auto rig = read_rig(a.of_recording.rig, left->size());
  if (!rig) return failure(rig);
  Stop stop;
  stop.mask_folder = std::filesystem::path(a.of_recording.rig).parent_path().string();
  StereoFrame frame;
  const StereoPair& pair = rig->pairs.front();
  const Camera& camera = *rig->find_camera(pair.left);
  frame.pair = pair.name;
  frame.left = interpret(*left, camera.pixel_format);
  frame.right = interpret(*right, rig->find_camera(pair.right)->pixel_format);
  for (const PanTiltUnit& unit : rig->pan_tilt_units) {
    if (unit.name != camera.mount) continue;
    frame.pan_rad = unit.rest_pan_rad;
    frame.tilt_rad = unit.rest_tilt_rad;
  }
  stop.frames.push_back(std::move(frame));
  stop.rig = std::move(*rig);
  return stop;
}

// The frames of the requested stop, or the requested frame of the odometry pair.
Result<std::vector<FrameKey>> frames_to_map(const Recording& source, const BuildArguments& a) {
  if (a.frame) {
    const StereoPair* const pair = odometry_pair_of(source.info().rig, {});
    if (pair == nullptr) return failure(ErrorCode::configuration, "the rig has no pair for the odometry", a.recording);
    const std::vector<Stamp> stamps = source.listed_stamps(pair->name);
    if (static_cast<std::size_t>(*a.frame) < stamps.size())
      return std::vector<FrameKey>{{pair->name, stamps[static_cast<std::size_t>(*a.frame)]}};
    return failure(ErrorCode::input, fmt::format("has no frame {}, it lists {}", *a.frame, stamps.size()), a.recording,
                   "frames count from 0");
  }
  std::vector<FrameKey> frames = source.frames_at(*a.position);
  if (!frames.empty()) return frames;
  return failure(
      ErrorCode::input, fmt::format("has no frame of the stop with position_id {}", *a.position), a.recording,
      "recordings of Spartan list the position_id of every frame in frames.csv; --frame maps a single frame");
}

Result<Stop> load_stop(const Context& context, const BuildArguments& a) {
  const auto open = open_options(a.of_recording);
  if (!open) return failure(open);
  auto source = open_recording(a.recording, *open);
  if (!source) return failure(source);
  log_remarks((*source)->info(), context.log);
  const RecordingInfo& info = (*source)->info();
  Stop stop;
  stop.rig = info.rig;
  stop.mask_folder = info.mask_folder();
  const auto listed = frames_to_map(**source, a);
  if (!listed) return failure(listed);
  const std::vector<FrameKey>& frames_of_stop = *listed;
  for (const FrameKey& name : frames_of_stop) {
    auto frame = (*source)->frame_at(name.pair, name.left_stamp);
    if (!frame) return failure(frame);
    stop.frames.push_back(std::move(*frame));
  }
  const auto imu = (*source)->imu_samples(frames_of_stop.front().left_stamp, kRestSeconds);
  if (!imu) return failure(imu);
  LocalizationOptions planet;
  planet.gravity_m_s2 = info.gravity_m_s2.value_or(planet.gravity_m_s2);
  if (const auto rest = static_reading(*imu, planet)) {
    stop.up_in_body = rest->accel_m_s2.normalized();
    stop.up_source = "measured by the IMU";
  }
  return stop;
}

Result<RunOptions> options_of(const Context& context, const BuildArguments& a) {
  auto options = run_options(context, a.config, a.set);
  if (!options) return failure(options);
  MappingOptions& mapping = options->mapping;
  if (a.extent_m) {
    mapping.map.extent_m = *a.extent_m;
    mapping.merging.max_range_m = std::max(kMinRange_m, kReach * *a.extent_m);
  }
  if (a.cell_m) mapping.map.cell_m = *a.cell_m;
  return options;
}

struct Tilt {
  double roll_rad = 0, pitch_rad = 0;
};

// From the up direction in the body frame: pitch (positive: nose down) and roll (positive: left side up).
Tilt tilt_of(const Eigen::Vector3d& up_in_body) {
  return {std::atan2(up_in_body.y(), up_in_body.z()),
          std::atan2(-up_in_body.x(), std::hypot(up_in_body.y(), up_in_body.z()))};
}

int count_of(const LocalMap& map, GroundClass kind) {
  int count = 0;
  for (int y = 0; y < map.size().height; ++y) {
    for (int x = 0; x < map.size().width; ++x) count += map.kind(x, y) == kind ? 1 : 0;
  }
  return count;
}

// Height and pitch of the left camera of each view: from the rig, and from the ground profile.
// The camera over the ground as the rig states it; none where the rig has no body on the ground.
std::optional<GroundPlane> ground_by_rig(const StopView& view, const Rig& rig, const Eigen::Vector3d& up) {
  if (rig.convention == PoseConvention::left_optical) return std::nullopt;
  return GroundPlane{view.geometry.body_from_left.rotation().conjugate() * up,
                     view.geometry.body_from_left.translation().dot(up)};
}

// Warns where the ground in the images is not where the rig says.
void compare_grounds(const StopMapper& mapper, const Rig& rig, const Eigen::Vector3d& up, const Log& log) {
  for (const StopView& view : mapper.views()) {
    const auto by_rig = ground_by_rig(view, rig, up);
    if (!by_rig || !view.ground) continue;
    const GroundPlane& seen = view.ground->plane;
    const double height_ratio = seen.height_m / by_rig->height_m - 1,
                 pitch_deg = (seen.pitch_rad() - by_rig->pitch_rad()) / kRadiansPerDegree;
    if (std::abs(height_ratio) <= kHeightTolerance && std::abs(pitch_deg) <= kPitchTolerance_deg) continue;
    log.warning(fmt::format(
        "pair {}: the ground in the images and the rig disagree: height of the camera {:.3f} m, not {:.3f} m ({:+.0f} "
        "%), pitch {:+.1f} deg; check the mounts of the cameras, and the attitude (--gravity)",
        view.pair, seen.height_m, by_rig->height_m, 100 * height_ratio, pitch_deg));
  }
}

Json views_of(const StopMapper& mapper, const Rig& rig, const Eigen::Vector3d& up) {
  Json views = Json::array();
  for (const StopView& view : mapper.views()) {
    const auto by_rig = ground_by_rig(view, rig, up);
    Json json{{"pair", view.pair}, {"stamp_ns", view.stamp.ns}, {"rig", nullptr}, {"ground", nullptr}};
    if (by_rig) json["rig"] = {{"pitch_deg", by_rig->pitch_rad() / kRadiansPerDegree}, {"height_m", by_rig->height_m}};
    if (view.ground) {
      json["ground"] = {{"pitch_deg", view.ground->plane.pitch_rad() / kRadiansPerDegree},
                        {"height_m", view.ground->plane.height_m}};
    }
    views.push_back(std::move(json));
  }
  return views;
}

Json stop_to_json(const StopMapper& mapper, const LocalMap& map, const Stop& stop, const Eigen::Vector3d& up) {
  const Tilt tilt = tilt_of(up);
  return {{"schema", 1},
          {"cell_m", map.place.cell_m},
          {"west_m", map.place.west_m},
          {"north_m", map.place.north_m},
          {"columns", map.size().width},
          {"rows", map.size().height},
          {"cells",
           {{"free", count_of(map, GroundClass::ground)},
            {"obstacle", count_of(map, GroundClass::obstacle)},
            {"cavity", count_of(map, GroundClass::cavity)}}},
          {"obstacles", map.obstacles.size()},
          {"attitude",
           {{"roll_deg", tilt.roll_rad / kRadiansPerDegree},
            {"pitch_deg", tilt.pitch_rad / kRadiansPerDegree},
            {"source", stop.up_source}}},
          {"views", views_of(mapper, stop.rig, up)},
          {"time_ms",
           {{"disparity", mapper.times().disparity},
            {"v_disparity", mapper.times().v_disparity},
            {"merging", mapper.times().merging},
            {"map", mapper.times().map}}},
          {"peak_memory_bytes", peak_memory_bytes()}};
}

std::string to_text(const Json& json, const std::string& folder) {
  const Json& cells = json["cells"];
  std::string text =
      fmt::format("attitude: roll {:.2f} deg, pitch {:.2f} deg ({})\n", json["attitude"]["roll_deg"].get<double>(),
                  json["attitude"]["pitch_deg"].get<double>(), json["attitude"]["source"].get<std::string>());
  for (const Json& view : json["views"]) {
    text += fmt::format("{:<17} ", fmt::format("pair {}:", view["pair"].get<std::string>()));
    text += view["rig"].is_null()
                ? std::string("camera over the ground: unknown (rig); ")
                : fmt::format("camera height {:.3f} m, pitch {:.2f} deg down (rig); ",
                              view["rig"]["height_m"].get<double>(), view["rig"]["pitch_deg"].get<double>());
    text += view["ground"].is_null()
                ? std::string("no ground found\n")
                : fmt::format("{:.3f} m, {:.2f} deg (ground profile)\n", view["ground"]["height_m"].get<double>(),
                              view["ground"]["pitch_deg"].get<double>());
  }
  const Json& time = json["time_ms"];
  text += fmt::format(
      "disparity {:.0f} ms, v-disparity {:.0f} ms, merging {:.0f} ms, map {:.0f} ms; peak memory {:.0f} MB\n",
      time["disparity"].get<double>(), time["v_disparity"].get<double>(), time["merging"].get<double>(),
      time["map"].get<double>(), 1e-6 * json["peak_memory_bytes"].get<double>());
  text += fmt::format("{} x {} cells of {} m: {} free, {} obstacle, {} cavity; {} separate obstacles; results in {}\n",
                      json["columns"].get<int>(), json["rows"].get<int>(), json["cell_m"].get<double>(),
                      cells["free"].get<int>(), cells["obstacle"].get<int>(), cells["cavity"].get<int>(),
                      json["obstacles"].get<std::size_t>(), folder);
  return text;
}

Status check(const BuildArguments& a) {
  const bool pair = !a.left.empty() || !a.right.empty();
  if (pair == !a.recording.empty()) {
    return failure(ErrorCode::usage, "give two images with --rig, or --recording with --position or --frame",
                   "map build");
  }
  if (pair && (a.right.empty() || a.of_recording.rig.empty())) {
    return failure(ErrorCode::usage,
                   a.right.empty() || a.left.empty() ? "give both LEFT and RIGHT" : "LEFT and RIGHT need --rig",
                   "map build", "their calibration");
  }
  if (!pair && a.position.has_value() == a.frame.has_value()) {
    return failure(ErrorCode::usage, "--recording needs one of --position and --frame", "map build");
  }
  return {};
}

// Without an attitude measurement the ground plane is taken as level.
Eigen::Vector3d choose_up(Stop& stop, const StopView& view) {
  if (stop.up_in_body) return *stop.up_in_body;
  if (stop.rig.convention != PoseConvention::left_optical || !view.ground) return Eigen::Vector3d::UnitZ();
  stop.up_source = "along the ground";
  return view.geometry.body_from_left.rotation() * view.ground->plane.up;
}

Result<ExitCode> build(const Context& context, const BuildArguments& a) {
  if (Status s = check(a); !s) return failure(s);
  if (Status s = expect_new_folder(context, a.output); !s) return failure(s);
  const auto gravity = parse_gravity(a.gravity);
  if (!gravity) return failure(gravity);
  auto options = options_of(context, a);
  if (!options) return failure(options);
  auto stop = a.recording.empty() ? load_pair(a) : load_stop(context, a);
  if (!stop) return failure(stop);
  options = resolved_options(std::move(*options), stop->rig);
  if (*gravity) {
    stop->up_in_body = *gravity;
    stop->up_source = "given";
  }
  const ThreadPool workers(context.threads);
  auto imager = Imager::create(stop->rig, options->imaging, workers, stop->mask_folder);
  if (!imager) return failure(imager);
  for (const StereoFrame& frame : stop->frames) {
    const RectifiedStereo geometry = imager->geometry(frame.pair);
    const DisparityRange range = disparity_range(geometry, stop->rig.find_pair(frame.pair)->nearest_m);
    if (Status s = DisparityComputer::check_memory(geometry.size, range, context.threads, memory_bound(context)); !s)
      return failure(s);
  }
  auto created = StopMapper::create(options->reconstruction, options->mapping, workers);
  if (!created) return failure(created);
  StopMapper& mapper = *created;
  Eigen::Vector3d ahead_in_body = Eigen::Vector3d::UnitX();
  for (const StereoFrame& frame : stop->frames) {
    if (Status s = expect_not_interrupted(); !s) return failure(s);
    const auto pair = imager->process(frame);
    if (!pair) return failure(pair);
    if (mapper.views().empty()) ahead_in_body = pair->body_from_left.rotation() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d expected = stop->up_in_body.value_or(Eigen::Vector3d::UnitZ());
    if (Status s = mapper.add(*pair, stop->rig.find_pair(frame.pair)->nearest_m, expected); !s) return failure(s);
  }
  const Eigen::Vector3d up = choose_up(*stop, mapper.views().front());
  if (Status s = expect_not_interrupted(); !s) return failure(s);
  const MergedRange merged = mapper.merge();
  const LocalMap map = mapper.map(surface_points(merged), first_pose(up, ahead_in_body, 0));
  if (Status s = expect_not_interrupted(); !s) return failure(s);
  if (Status s = make_folder(a.output); !s) return failure(s);
  if (Status s = write_stop_files(mapper.views(), merged, map, options->mapping, a.output); !s) return failure(s);
  compare_grounds(mapper, stop->rig, up, context.log);
  const Json json = stop_to_json(mapper, map, *stop, up);
  if (Status s = print(context.json ? text_of(json) + "\n" : to_text(json, a.output)); !s) return failure(s);
  return kDone;
}

}  // namespace

void add_map_build(CLI::App& map, Context& context) {
  auto a = std::make_shared<BuildArguments>();
  CLI::App* command =
      add_command(map, context, "build", "Build the terrain map of one pair of images or of one stop",
                  "map build --recording drive --position 1 -o map", [&context, a] { return build(context, *a); });
  command->add_option("left", a->left, "Left image.");
  command->add_option("right", a->right, "Right image.");
  command->add_option("-o,--output", a->output, "Folder for the results; created if missing.")->required();
  command->add_option("--rig", a->of_recording.rig,
                      "Rig or calibration file, in any supported format; required with LEFT and RIGHT (default: the "
                      "recording's own).");
  command->add_option("--recording", a->recording,
                      "Recording to take one stop or one frame from (default: none, the images LEFT and RIGHT).");
  add_recording_options(*command, a->of_recording);
  command->add_option("--position", a->position,
                      "Id of the stop: the position_id in frames.csv; all of its frames are merged (default: none, "
                      "see --frame).");
  command
      ->add_option("--frame", a->frame,
                   "Number of a frame of the odometry pair, from 0, instead of a stop (default: none).")
      ->check(non_negative_number());
  command
      ->add_option(
          "--extent-m", a->extent_m,
          "Side length of the map in metres (default 8). A larger one covers more terrain and costs memory and time; "
          "overrides mapping.map.extent_m.")
      ->check(CLI::Range(0.5, 1000.0));
  command
      ->add_option("--cell-m", a->cell_m,
                   "Side length of a cell in metres (default 0.05). A smaller one costs time and memory.")
      ->check(CLI::Range(0.005, 10.0));
  command->add_option(
      "--gravity", a->gravity,
      "Direction of gravity in the body frame, x,y,z (default: from the IMU; without one, from the fitted ground "
      "plane if the rig has no body frame, else 0,0,-1).");
  command->add_option("--config", a->config,
                      "YAML file with options that differ from the defaults (see `spartan config dump`).");
  command
      ->add_option("--set", a->set, "Set one option, e.g. mapping.map.obstacle_m=0.03. Repeatable; overrides --config.")
      ->allow_extra_args(false)
      ->option_text("KEY=VALUE");
  add_force_flag(*command, context);
  add_threads_option(*command, context);
  add_memory_option(*command, context);
  add_json_flag(*command, context);
}

}  // namespace spartan::program
