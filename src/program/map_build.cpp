// spartan map build: the ground in a pair of images, or around a position of a recording.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "program/json.h"
#include "program/map.h"
#include "program/run_arguments.h"
#include "spartan/camera/frame_source.h"
#include "spartan/camera/interpretation.h"
#include "spartan/core/files.h"
#include "spartan/core/image_io.h"
#include "spartan/core/process.h"
#include "spartan/imaging/imager.h"
#include "spartan/localization/start_frame.h"
#include "spartan/reconstruction/position_mapper.h"
#include "spartan/rig/formats/rig_files.h"
#include "spartan/system/map_files.h"

namespace spartan::program {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kRestSeconds = 1;  // of the IMU, from a position's first shot on
constexpr double kReach = 0.75;     // of the map's side: somewhat more than half of its diagonal

struct BuildArguments {
  std::string left, right, output, rig, recording, gravity, config;
  std::vector<std::string> set;
  std::optional<std::int64_t> position;
  std::optional<double> extent_m, cell_m;
};

// The shots of one position and how the body stands there.
struct Position {
  Rig rig;
  std::string mask_folder;
  std::vector<StereoFrame> frames;
  std::optional<Eigen::Vector3d> up_in_body;
  const char* up_source = "assumed along the body";
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
      return failure(ErrorCode::usage, fmt::format("'{}' is not three numbers", text), "--gravity",
                     "where gravity points in the body frame (x forward, y left, z up), like 0,0,-1");
    }
    from = to + 1;
  }
  const Eigen::Vector3d down(g[0], g[1], g[2]);
  if (down.norm() < 1e-9) return failure(ErrorCode::usage, "has no direction", "--gravity");
  return Eigen::Vector3d(-down.normalized());
}

Result<Position> load_pair(const BuildArguments& a) {
  auto left = read_image(a.left);
  if (!left) return failure(left);
  auto right = read_image(a.right);
  if (!right) return failure(right);
  auto rig = read_rig(a.rig, left->size());
  if (!rig) return failure(rig);
  Position position;
  position.mask_folder = std::filesystem::path(a.rig).parent_path().string();
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
  position.frames.push_back(std::move(frame));
  position.rig = std::move(*rig);
  return position;
}

Result<Position> load_position(const BuildArguments& a) {
  auto source = open_recording(a.recording);
  if (!source) return failure(source);
  const RecordingInfo& info = (*source)->info();
  Position position;
  position.rig = info.rig;
  position.mask_folder = std::filesystem::path(info.rig_source).parent_path().string();
  const auto shots = (*source)->shots_at(*a.position);
  if (shots.empty()) {
    return failure(ErrorCode::input, fmt::format("has no shot at position {}", *a.position), a.recording,
                   "frames.csv lists the position_id of every shot");
  }
  for (const ShotName& shot : shots) {
    auto frame = (*source)->frame_at(shot.pair, shot.left_stamp);
    if (!frame) return failure(frame);
    position.frames.push_back(std::move(*frame));
  }
  const auto imu = (*source)->imu_samples(shots.front().left_stamp, kRestSeconds);
  if (!imu) return failure(imu);
  LocalizationOptions planet;
  planet.gravity_m_s2 = info.gravity_m_s2.value_or(planet.gravity_m_s2);
  if (const auto rest = read_rest(*imu, planet)) {
    position.up_in_body = rest->accel_m_s2.normalized();
    position.up_source = "measured by the IMU";
  }
  return position;
}

Result<RunOptions> options_of(const BuildArguments& a) {
  auto options = run_options(a.config, a.set);
  if (!options) return failure(options);
  MappingOptions& mapping = options->mapping;
  if (a.extent_m) {
    mapping.map.extent_m = *a.extent_m;
    mapping.merging.farthest_m = kReach * *a.extent_m;
  }
  if (a.cell_m) mapping.map.cell_m = *a.cell_m;
  return options;
}

struct Tilt {
  double roll_rad = 0, pitch_rad = 0;
};

// Of a body whose upward direction is known: z up, then pitch (nose down positive) and roll (left side up positive).
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

// Eye height and tilt of each view: as the ground says, and as the rig does.
Json views_of(const PositionMapper& mapper, const Eigen::Vector3d& up) {
  Json views = Json::array();
  for (const PositionView& view : mapper.views()) {
    const GroundPlane believed{view.geometry.body_from_left.rotation().conjugate() * up,
                               view.geometry.body_from_left.translation().dot(up)};
    Json json{{"pair", view.pair},
              {"stamp_ns", view.stamp.ns},
              {"rig", {{"pitch_deg", believed.pitch_rad() / kDegree}, {"height_m", believed.height_m}}},
              {"ground", nullptr}};
    if (view.ground) {
      json["ground"] = {{"pitch_deg", view.ground->plane.pitch_rad() / kDegree},
                        {"height_m", view.ground->plane.height_m}};
    }
    views.push_back(std::move(json));
  }
  return views;
}

Json to_json(const PositionMapper& mapper, const LocalMap& map, const Position& position, const Eigen::Vector3d& up) {
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
           {{"roll_deg", tilt.roll_rad / kDegree},
            {"pitch_deg", tilt.pitch_rad / kDegree},
            {"source", position.up_source}}},
          {"views", views_of(mapper, up)},
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
    text += fmt::format("{:<12} eye {:.3f} m high, {:.2f} deg down by the rig; ", view["pair"].get<std::string>(),
                        view["rig"]["height_m"].get<double>(), view["rig"]["pitch_deg"].get<double>());
    text += view["ground"].is_null()
                ? std::string("no ground found\n")
                : fmt::format("{:.3f} m, {:.2f} deg by the ground\n", view["ground"]["height_m"].get<double>(),
                              view["ground"]["pitch_deg"].get<double>());
  }
  const Json& time = json["time_ms"];
  text += fmt::format(
      "{:.0f} ms for disparities, {:.0f} ms for v-disparity, {:.0f} ms for merging, {:.0f} ms for the map; "
      "{:.0f} MB at most\n",
      time["disparity"].get<double>(), time["v_disparity"].get<double>(), time["merging"].get<double>(),
      time["map"].get<double>(), 1e-6 * json["peak_memory_bytes"].get<double>());
  text += fmt::format("{} x {} cells of {} m: {} free, {} obstacle, {} cavity; {} obstacles; results in {}\n",
                      json["columns"].get<int>(), json["rows"].get<int>(), json["cell_m"].get<double>(),
                      cells["free"].get<int>(), cells["obstacle"].get<int>(), cells["cavity"].get<int>(),
                      json["obstacles"].get<std::size_t>(), folder);
  return text;
}

Status check(const BuildArguments& a) {
  const bool pair = !a.left.empty() || !a.right.empty() || !a.rig.empty();
  if (pair == !a.recording.empty()) {
    return failure(ErrorCode::usage, "needs two images with --rig, or --recording with --position", "map build");
  }
  if (pair && (a.right.empty() || a.rig.empty())) {
    return failure(ErrorCode::usage, "two images need each other and a --rig", "map build");
  }
  if (!pair && !a.position) return failure(ErrorCode::usage, "--recording needs --position", "map build");
  return {};
}

// Where nobody knows how the camera stands, level is what the ground is.
Eigen::Vector3d choose_up(Position& position, const PositionView& view) {
  if (position.up_in_body) return *position.up_in_body;
  if (position.rig.convention != PoseConvention::left_optical || !view.ground) return Eigen::Vector3d::UnitZ();
  position.up_source = "along the ground";
  return view.geometry.body_from_left.rotation() * view.ground->plane.up;
}

Result<ExitCode> build(const Context& context, const BuildArguments& a) {
  if (Status s = check(a); !s) return failure(s);
  const auto gravity = parse_gravity(a.gravity);
  if (!gravity) return failure(gravity);
  const auto options = options_of(a);
  if (!options) return failure(options);
  auto position = a.recording.empty() ? load_pair(a) : load_position(a);
  if (!position) return failure(position);
  if (*gravity) {
    position->up_in_body = *gravity;
    position->up_source = "given";
  }
  const Workers workers(context.threads);
  auto imager = Imager::create(position->rig, options->imaging, workers, position->mask_folder);
  if (!imager) return failure(imager);
  PositionMapper mapper(options->reconstruction, options->mapping, workers);
  Eigen::Vector3d ahead_in_body = Eigen::Vector3d::UnitX();
  for (const StereoFrame& frame : position->frames) {
    const auto shot = imager->process(frame);
    if (!shot) return failure(shot);
    if (mapper.views().empty()) ahead_in_body = shot->body_from_left.rotation() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d expected = position->up_in_body.value_or(Eigen::Vector3d::UnitZ());
    if (Status s = mapper.add(*shot, position->rig.find_pair(frame.pair)->nearest_m, expected); !s) return failure(s);
  }
  const Eigen::Vector3d up = choose_up(*position, mapper.views().front());
  const MergedRange merged = mapper.merge();
  const LocalMap map = mapper.map(surface_points(merged), first_pose(up, ahead_in_body, 0));
  if (Status s = make_folder(a.output); !s) return failure(s);
  if (Status s = write_position(mapper.views(), merged, map, options->mapping, a.output); !s) return failure(s);
  const Json json = to_json(mapper, map, *position, up);
  if (Status s = print(context.json ? json.dump(2) + "\n" : to_text(json, a.output)); !s) return failure(s);
  return kDone;
}

}  // namespace

void add_map_build(CLI::App& map, Context& context) {
  auto a = std::make_shared<BuildArguments>();
  CLI::App* verb =
      add_verb(map, context, "build", "The ground around one position of the rover as a grid",
               "map build --recording drive --position 15 -o map", [&context, a] { return build(context, *a); });
  verb->add_option("left", a->left, "left image");
  verb->add_option("right", a->right, "right image");
  verb->add_option("-o,--output", a->output, "folder for the results")->required();
  verb->add_option("--rig", a->rig, "rig or calibration file of the two images");
  verb->add_option("--recording", a->recording, "recording to take a position from");
  verb->add_option("--position", a->position, "position_id: all shots that have it are merged");
  verb->add_option("--extent-m", a->extent_m, "side of the map (default 8)")->check(CLI::Range(0.5, 1000.0));
  verb->add_option("--cell-m", a->cell_m, "side of a cell (default 0.05)")->check(CLI::Range(0.005, 10.0));
  verb->add_option("--gravity", a->gravity,
                   "where gravity points in the body frame, x,y,z (default: as the IMU says, else straight down)");
  verb->add_option("--config", a->config, "YAML file with options (see `spartan config dump`)");
  verb->add_option("--set", a->set, "one option, like mapping.map.obstacle_m=0.03; may be given again")
      ->allow_extra_args(false);
  add_threads_option(*verb, context);
  add_json_flag(*verb, context);
}

}  // namespace spartan::program
