#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <utility>

#include "spartan/core/files.h"
#include "spartan/core/pose.h"
#include "spartan/core/strict_yaml.h"
#include "spartan/rig/internal/camera_driver.h"
#include "spartan/rig/rig.h"

namespace spartan {

namespace {

constexpr int kSchema = 1;
constexpr std::size_t kMaxEntries = 1000;  // cameras, pairs or pan-tilt units of a rig
constexpr PixelLayout kLayouts[] = {PixelLayout::gray,       PixelLayout::rgb,        PixelLayout::bayer_rggb,
                                    PixelLayout::bayer_grbg, PixelLayout::bayer_gbrg, PixelLayout::bayer_bggr};

std::array<std::pair<const char*, double*>, 5> values_of(CalibrationErrors& errors) {
  return {{{"pair_rotation_deg", &errors.pair_rotation_deg},
           {"scale_percent", &errors.scale_percent},
           {"mount_rotation_deg", &errors.mount_rotation_deg},
           {"mount_mm", &errors.mount_mm},
           {"pan_tilt_deg", &errors.pan_tilt_deg}}};
}

// --- reading ---

std::optional<Eigen::Quaterniond> read_quaternion(YamlMap& map) {
  const auto q = map.numbers("quaternion_xyzw", {4});
  if (!q) return std::nullopt;
  const Eigen::Quaterniond quaternion((*q)[3], (*q)[0], (*q)[1], (*q)[2]);
  const double length = quaternion.norm();
  if (!(std::abs(length - 1) <= 1e-3)) {
    map.add_error("quaternion_xyzw", fmt::format("has length {:.6g}, must have length 1", length));
    return std::nullopt;
  }
  // A quaternion written by a program is restored bit for bit; one rounded by hand is normalized.
  return std::abs(length - 1) < 1e-12 ? quaternion : quaternion.normalized();
}

// R = Rz(yaw) Ry(pitch) Rx(roll); with y to the left, a positive pitch looks down.
std::optional<Eigen::Quaterniond> read_roll_pitch_yaw(YamlMap& map) {
  const auto degrees = map.numbers("roll_pitch_yaw_deg", {3});
  if (!degrees) return std::nullopt;
  const auto turn = [&](std::size_t i, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd((*degrees)[i] * kRadiansPerDegree, axis);
  };
  return Eigen::Quaterniond(turn(2, Eigen::Vector3d::UnitZ()) * turn(1, Eigen::Vector3d::UnitY()) *
                            turn(0, Eigen::Vector3d::UnitX()));
}

// translation_m with either quaternion_xyzw or roll_pitch_yaw_deg; no rotation if both are missing.
Pose read_pose(YamlMap& map) {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  const bool has_quaternion = map.has("quaternion_xyzw"), has_angles = map.has("roll_pitch_yaw_deg");
  if (has_quaternion && has_angles) {
    map.add_error("roll_pitch_yaw_deg", "the rotation is given twice; remove this or quaternion_xyzw");
  }
  if (has_quaternion) rotation = read_quaternion(map).value_or(rotation);
  if (has_angles) rotation = read_roll_pitch_yaw(map).value_or(rotation);
  const auto t = map.numbers("translation_m", {3});
  return Pose::from_unit_quaternion(rotation, t ? Eigen::Vector3d((*t)[0], (*t)[1], (*t)[2]) : Eigen::Vector3d::Zero());
}

PanTiltUnit read_pan_tilt_unit(const std::string& name, YamlMap map) {
  PanTiltUnit unit{name, read_pose(map)};
  double scale = 1;
  std::optional<std::vector<double>> angles;
  const bool in_radians = map.has("rest_angles_rad"), in_degrees = map.has("rest_angles_deg");
  if (in_radians && in_degrees) {
    map.add_error("rest_angles_deg", "the angles are given twice; remove this or rest_angles_rad");
  }
  if (in_radians) angles = map.numbers("rest_angles_rad", {2});
  if (in_degrees) {
    angles = map.numbers("rest_angles_deg", {2});
    scale = kRadiansPerDegree;
  }
  if (angles) {
    unit.rest_pan_rad = (*angles)[0] * scale;
    unit.rest_tilt_rad = (*angles)[1] * scale;
  }
  map.reject_unknown_keys();
  return unit;
}

CameraModel read_model(YamlMap& map) {
  const std::vector<std::string_view> known = camera_model_names();
  const auto name = map.choice("model", {known.begin(), known.end()});
  if (!name) {
    // If the model is unknown, the keys of all models are accepted to avoid follow-up errors.
    for (const std::string_view other : known) {
      for (const auto& kind : parameter_specs(*camera_model_named(other))) (void)map.has(kind.key);
    }
    return {};
  }
  const CameraModel model = *camera_model_named(*name);
  ModelParameters numbers = parameters(model);
  const auto kinds = parameter_specs(model);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    numbers[i] = map.numbers(kinds[i].key, kinds[i].counts).value_or(numbers[i]);
  }
  return with_parameters(model, numbers);
}

PixelFormat read_pixel_format(YamlMap& map) {
  PixelFormat format;
  if (map.has("pixel_layout")) {
    std::vector<std::string> names;
    for (const PixelLayout layout : kLayouts) names.emplace_back(name_of(layout));
    const auto name = map.choice("pixel_layout", names);
    for (const PixelLayout layout : kLayouts) {
      if (name && *name == name_of(layout)) format.layout = layout;
    }
  }
  if (map.has("bits")) format.bits = map.integer("bits").value_or(format.bits);
  if (map.has("bit_alignment") && map.choice("bit_alignment", {"low", "high"}) == "high") {
    format.alignment = BitAlignment::high;
  }
  return format;
}

Camera read_camera(const std::string& name, YamlMap map) {
  Camera camera;
  camera.name = name;
  if (const auto size = map.numbers("size_px", {2})) {
    if (std::abs((*size)[0]) > 1e6 || std::abs((*size)[1]) > 1e6 || std::floor((*size)[0]) != (*size)[0] ||
        std::floor((*size)[1]) != (*size)[1]) {
      map.add_error("size_px", "must be two whole numbers, width and height");
    } else {
      camera.size = {static_cast<int>((*size)[0]), static_cast<int>((*size)[1])};
    }
  }
  camera.model = read_model(map);
  camera.pixel_format = read_pixel_format(map);
  if (map.has("vignetting")) {
    camera.vignetting.coefficients = map.numbers("vignetting", {1, 2, 3}).value_or(std::vector<double>());
  }
  if (map.has("vignetting_centre_px")) {
    const auto centre = map.numbers("vignetting_centre_px", {2});
    if (centre) camera.vignetting.centre_px = Eigen::Vector2d((*centre)[0], (*centre)[1]);
  }
  if (map.has("self_mask")) camera.self_mask = map.text("self_mask").value_or("");
  if (map.has("mount")) camera.mount = map.text("mount").value_or(camera.mount);
  // The orientation of a camera without rotation is explicit in the file, not a default.
  const auto axes = map.choice("axes", {"optical", "forward"});
  camera.mount_from_camera = read_pose(map);
  if (axes == "forward") camera.mount_from_camera = camera.mount_from_camera * optical_from_forward().inverse();
  if (const auto driver = map.optional_node("driver"))
    camera.driver = internal::read_camera_driver(YamlMap(*driver, map.path("driver"), map.errors()));
  map.reject_unknown_keys();
  return camera;
}

StereoPair read_pair(const std::string& name, YamlMap map) {
  StereoPair pair;
  pair.name = name;
  pair.left = map.text("left").value_or("");
  pair.right = map.text("right").value_or("");
  if (map.has("nearest_m")) pair.nearest_m = map.number("nearest_m").value_or(0);
  if (map.has("for_odometry")) pair.for_odometry = map.boolean("for_odometry").value_or(true);
  map.reject_unknown_keys();
  return pair;
}

// Reads the entries of a group, each by `read(name, map)`.
template <class T, class Read>
std::vector<T> read_group(YamlMap& root, const char* key, bool required, Read read) {
  std::vector<T> items;
  const auto node = required ? root.node(key) : root.optional_node(key);
  if (!node) return items;
  YamlMap group(*node, key, root.errors());
  if (group.entries().size() > kMaxEntries) {
    root.add_error(key, fmt::format("has {} entries, more than {}", group.entries().size(), kMaxEntries));
    return items;
  }
  for (const auto& [name, entry] : group.entries()) {
    items.push_back(read(name, YamlMap(entry, group.path(name), root.errors())));
  }
  return items;
}

Eigen::Vector3d vector_of(const std::vector<double>& v) {
  return {v[0], v[1], v[2]};
}

void read_rover(YamlMap map, Rig& rig) {
  RoverGeometry& rover = rig.rover;
  if (map.has("track_m")) rover.track_m = map.number("track_m").value_or(rover.track_m);
  if (map.has("wheel_radius_m")) rover.wheel_radius_m = map.number("wheel_radius_m").value_or(rover.wheel_radius_m);
  if (map.has("clearance_m")) rover.clearance_m = map.number("clearance_m").value_or(rover.clearance_m);
  if (map.has("turning_centre_m")) {
    if (const auto centre = map.numbers("turning_centre_m", {3})) rig.turning_centre_m = vector_of(*centre);
  }
  map.reject_unknown_keys();
}

ImuMount read_imu(YamlMap map) {
  ImuMount imu{read_pose(map), 0};
  if (map.has("time_offset_s")) imu.time_offset_s = map.number("time_offset_s").value_or(0);
  map.reject_unknown_keys();
  return imu;
}

CalibrationErrors read_calibration_errors(YamlMap map) {
  CalibrationErrors errors;
  for (const auto& [key, value] : values_of(errors)) {
    if (!map.has(key)) continue;
    *value = map.number(key).value_or(*value);
    if (*value < 0) map.add_error(key, "is a standard deviation and must not be negative");
  }
  map.reject_unknown_keys();
  return errors;
}

Rig read_root(YamlMap root, const std::string& default_name) {
  Rig rig;
  rig.name = default_name;
  if (const auto schema = root.integer("schema"); schema && *schema != kSchema) {
    root.add_error("schema", fmt::format("is {}; this version reads schema {}", *schema, kSchema));
  }
  if (root.has("name")) rig.name = root.text("name").value_or(default_name);
  if (root.has("pose_convention") && root.choice("pose_convention", {"body", "left_optical"}) == "left_optical") {
    rig.convention = PoseConvention::left_optical;
  }
  if (const auto rover = root.optional_node("rover")) read_rover(YamlMap(*rover, "rover", root.errors()), rig);
  if (const auto imu = root.optional_node("imu")) rig.imu = read_imu(YamlMap(*imu, "imu", root.errors()));
  if (const auto errors = root.optional_node("calibration_errors"))
    rig.calibration_errors = read_calibration_errors(YamlMap(*errors, "calibration_errors", root.errors()));
  rig.pan_tilt_units = read_group<PanTiltUnit>(root, "pan_tilt_units", false, read_pan_tilt_unit);
  rig.cameras = read_group<Camera>(root, "cameras", true, read_camera);
  rig.pairs = read_group<StereoPair>(root, "pairs", true, read_pair);
  root.reject_unknown_keys();
  return rig;
}

// Adds the faults found by Rig::validation_errors(), except those that follow from an error reported before.
void add_rig_faults(const Rig& rig, YamlErrors& errors) {
  std::vector<RigValidationError> found;
  for (const RigValidationError& fault : rig.validation_errors()) {
    const bool about_a_pair = fault.key.starts_with("pairs");
    if (errors.has_error_near(fault.key) || (about_a_pair && errors.has_error_near("cameras"))) continue;
    found.push_back(fault);
  }
  for (const RigValidationError& fault : found) errors.add(fault.key, fault.what);
}

// --- writing ---

std::string list(const Eigen::Ref<const Eigen::VectorXd>& numbers) {
  return fmt::format("[{}]", fmt::join(numbers.data(), numbers.data() + numbers.size(), ", "));
}

std::string pose_lines(const Pose& pose) {
  return fmt::format("    translation_m: {}\n    quaternion_xyzw: {}\n", list(pose.translation()),
                     list(pose.rotation().coeffs()));
}

std::string camera_lines(const Camera& camera) {
  std::string text = fmt::format("  {}:\n    size_px: [{}, {}]\n    model: {}\n", yaml_quoted(camera.name),
                                 camera.size.width, camera.size.height, name_of(camera.model));
  const auto kinds = parameter_specs(camera.model);
  const ModelParameters numbers = parameters(camera.model);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    text += fmt::format("    {}: [{}]\n", kinds[i].key, fmt::join(numbers[i], ", "));
  }
  text +=
      fmt::format("    pixel_layout: {}\n    bits: {}\n    bit_alignment: {}\n", name_of(camera.pixel_format.layout),
                  camera.pixel_format.bits, camera.pixel_format.alignment == BitAlignment::high ? "high" : "low");
  if (!camera.vignetting.coefficients.empty()) {
    text += fmt::format("    vignetting: [{}]\n", fmt::join(camera.vignetting.coefficients, ", "));
  }
  if (camera.vignetting.centre_px) {
    text += fmt::format("    vignetting_centre_px: {}\n", list(*camera.vignetting.centre_px));
  }
  if (!camera.self_mask.empty()) text += fmt::format("    self_mask: {}\n", yaml_quoted(camera.self_mask));
  return text +
         fmt::format("    mount: {}\n    axes: optical\n{}", yaml_quoted(camera.mount),
                     pose_lines(camera.mount_from_camera)) +
         (camera.driver ? internal::camera_driver_lines(*camera.driver) : "");
}

std::string pair_lines(const StereoPair& pair) {
  return fmt::format("  {}:\n    left: {}\n    right: {}\n    nearest_m: {}\n    for_odometry: {}\n",
                     yaml_quoted(pair.name), yaml_quoted(pair.left), yaml_quoted(pair.right), pair.nearest_m,
                     pair.for_odometry);
}

}  // namespace

Result<Rig> parse_rig_yaml(const std::string& text, const std::string& name) {
  const auto loaded = parse_yaml(text, name);
  if (!loaded) return failure(loaded);
  YamlErrors errors(name);
  Rig rig = read_root(YamlMap(*loaded, "", errors), std::filesystem::path(name).stem().string());
  add_rig_faults(rig, errors);
  if (const Status status = errors.status(); !status) return failure(status);
  return rig;
}

Result<Rig> read_rig_yaml(const std::string& path) {
  const auto text = read_calibration_text(path);
  if (!text) return failure(text);
  return parse_rig_yaml(*text, path);
}

std::string to_rig_yaml(const Rig& rig) {
  std::string text = fmt::format("schema: {}\nname: {}\npose_convention: {}\n", kSchema, yaml_quoted(rig.name),
                                 rig.convention == PoseConvention::left_optical ? "left_optical" : "body");
  if (rig.rover != RoverGeometry() || !rig.turning_centre_m.isZero(0)) {
    text += fmt::format("rover:\n  track_m: {}\n  wheel_radius_m: {}\n  clearance_m: {}\n", rig.rover.track_m,
                        rig.rover.wheel_radius_m, rig.rover.clearance_m);
    if (!rig.turning_centre_m.isZero(0)) text += fmt::format("  turning_centre_m: {}\n", list(rig.turning_centre_m));
  }
  if (rig.imu != ImuMount()) {
    const Pose& pose = rig.imu.body_from_imu;
    text += fmt::format("imu:\n  translation_m: {}\n  quaternion_xyzw: {}\n  time_offset_s: {}\n",
                        list(pose.translation()), list(pose.rotation().coeffs()), rig.imu.time_offset_s);
  }
  if (rig.calibration_errors) {
    CalibrationErrors errors = *rig.calibration_errors;
    text += "calibration_errors:\n";
    for (const auto& [key, value] : values_of(errors)) text += fmt::format("  {}: {}\n", key, *value);
  }
  if (!rig.pan_tilt_units.empty()) text += "pan_tilt_units:\n";
  for (const PanTiltUnit& unit : rig.pan_tilt_units) {
    text += fmt::format("  {}:\n{}    rest_angles_rad: [{}, {}]\n", yaml_quoted(unit.name),
                        pose_lines(unit.body_from_base), unit.rest_pan_rad, unit.rest_tilt_rad);
  }
  text += "cameras:\n";
  for (const Camera& camera : rig.cameras) text += camera_lines(camera);
  text += "pairs:\n";
  for (const StereoPair& pair : rig.pairs) text += pair_lines(pair);
  return text;
}

}  // namespace spartan
