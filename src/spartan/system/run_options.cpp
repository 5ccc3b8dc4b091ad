#include "spartan/system/run_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace spartan {
namespace {

// What an operator of a rover sets: geometry of the rover, sensor noise, map size and thresholds, what is computed.
constexpr std::array<std::string_view, 30> kBasicOptions{
    "gravity_m_s2",
    "odometry_pair",
    "odometry_only",
    "use_specified_noise",
    "maps",
    "terrain.enabled",
    "terrain.every_m",
    "imaging.debayer",
    "imaging.view.policy",
    "odometry.detection.landmarks",
    "mapping.disparity_sigma_px",
    "mapping.map.extent_m",
    "mapping.map.cell_m",
    "mapping.map.obstacle_m",
    "mapping.map.cavity_m",
    "mapping.map.rover.max_slope_deg",
    "mapping.map.rover.max_step_m",
    "slam.map.memory_mb",
    "localization.imu.gyro_noise_rad_s_sqrt_hz",
    "localization.imu.gyro_bias_sigma_rad_s",
    "localization.imu.gyro_walk_rad_s2_sqrt_hz",
    "localization.imu.accel_noise_m_s2_sqrt_hz",
    "localization.imu.accel_bias_sigma_m_s2",
    "localization.imu.accel_walk_m_s3_sqrt_hz",
    "localization.wheels.use_rotation",
    "localization.compass.offset_walk_rad_per_sqrt_s",
    "localization.inclinometer.bias_walk_rad_per_sqrt_s",
    "localization.wheels.scale_sigma",
    "localization.compass.offset_sigma_rad",
    "localization.inclinometer.bias_sigma_rad",
};

bool has_pair_on_pan_tilt_unit(const Rig& rig) {
  return std::any_of(rig.pairs.begin(), rig.pairs.end(), [&](const StereoPair& pair) {
    const Camera* const left = rig.find_camera(pair.left);
    return left != nullptr && left->mount != "body";
  });
}

}  // namespace

const StereoPair* odometry_pair_of(const Rig& rig, const RunOptions& options) {
  if (!options.odometry_pair.empty()) return rig.find_pair(options.odometry_pair);
  const auto found = std::find_if(rig.pairs.begin(), rig.pairs.end(), [](const auto& p) { return p.for_odometry; });
  return found == rig.pairs.end() ? nullptr : &*found;
}

RunOptions resolved_options(RunOptions options, const Rig& rig) {
  const RunOptions defaults;
  const auto share = [](double& value, double by_default, double shared) {
    if (value == by_default) value = shared;
  };
  RoverGeometry& rover = options.mapping.map.rover.geometry;
  const RoverGeometry by_default;
  share(rover.track_m, by_default.track_m, rig.rover.track_m);
  share(rover.wheel_radius_m, by_default.wheel_radius_m, rig.rover.wheel_radius_m);
  share(rover.clearance_m, by_default.clearance_m, rig.rover.clearance_m);
  if (rig.calibration_errors) {
    CalibrationErrors& errors = options.mapping.map.calibration;
    const CalibrationErrors usual, &stated = *rig.calibration_errors;
    share(errors.pair_rotation_deg, usual.pair_rotation_deg, stated.pair_rotation_deg);
    share(errors.scale_percent, usual.scale_percent, stated.scale_percent);
    share(errors.mount_rotation_deg, usual.mount_rotation_deg, stated.mount_rotation_deg);
    share(errors.mount_mm, usual.mount_mm, stated.mount_mm);
    share(errors.pan_tilt_deg, usual.pan_tilt_deg, stated.pan_tilt_deg);
  }
  if (!rig.pairs.empty() && !has_pair_on_pan_tilt_unit(rig)) {
    double& pan_tilt_deg = options.mapping.map.calibration.pan_tilt_deg;
    share(pan_tilt_deg, CalibrationErrors().pan_tilt_deg, 0);
  }
  if (options.localization.imu.position_m.isZero(0))
    options.localization.imu.position_m = rig.imu.body_from_imu.translation();
  share(options.localization.imu.time_offset_s, 0, rig.imu.time_offset_s);
  if (options.localization.wheels.turning_centre_m.isZero(0))
    options.localization.wheels.turning_centre_m = rig.turning_centre_m;
  share(options.localization.wheels.track_m, defaults.localization.wheels.track_m, rig.rover.track_m);
  options.mapping = with_shared_values(options.mapping);
  return options;
}

std::span<const std::string_view> basic_options() {
  return kBasicOptions;
}

std::string dump_basic_options(const RunOptions& options) {
  std::map<std::string, std::string> by_default;
  for (const OptionLine& line : list_options(RunOptions())) by_default[line.key] = line.value;
  std::vector<OptionLine> lines = list_options(options);
  std::erase_if(lines, [&](const OptionLine& line) {
    const bool is_basic = std::find(kBasicOptions.begin(), kBasicOptions.end(), line.key) != kBasicOptions.end();
    return !is_basic && by_default[line.key] == line.value;
  });
  return options_detail::to_yaml(lines);
}

std::string option_differences(const RunOptions& before, const RunOptions& now) {
  constexpr std::size_t kMost = 5;
  std::map<std::string, std::string> former_values;
  for (const OptionLine& line : list_options(before)) former_values[line.key] = line.value;
  std::vector<std::string> differences;
  for (const OptionLine& line : list_options(now)) {
    const auto found = former_values.find(line.key);
    const std::string was = found == former_values.end() ? std::string("not set") : found->second;
    if (was == line.value) continue;
    if (differences.size() == kMost) {
      differences.emplace_back("…");
      break;
    }
    differences.push_back(fmt::format("{} was {}, is {}", line.key, was, line.value));
  }
  return fmt::format("{}", fmt::join(differences, "; "));
}

}  // namespace spartan
