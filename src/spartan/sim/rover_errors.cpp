// Differences between the calibration of a rover and the rover.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <variant>

#include "spartan/core/pose.h"
#include "spartan/numerics/random.h"
#include "spartan/sim/internal/drive/rover_seed.h"
#include "spartan/sim/scenario.h"

namespace spartan::sim {
namespace {

constexpr std::uint64_t kPairStream = 310, kUnitStream = 340,
                        kGainStream = 380;  // of random numbers; added to an index

// The model with its focal lengths scaled and its principal point moved, where it has such parameters.
CameraModel with_errors(const CameraModel& model, double focal_factor, const Eigen::Vector2d& centre_px) {
  ModelParameters values = parameters(model);
  const std::vector<ModelParameterSpec> kinds = parameter_specs(model);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i].key == "focal_px") {
      for (double& f : values[i]) f *= focal_factor;
    }
    if (kinds[i].key == "centre_px") {
      values[i].front() += centre_px.x();
      values[i].back() += centre_px.y();
    }
  }
  return with_parameters(model, values);
}

// Adds radial distortion that moves the corner of the image outwards: k1 = shift / (f r³), r of the farthest corner.
CameraModel with_distortion(const CameraModel& model, ImageSize size, double corner_px) {
  if (corner_px == 0) return model;
  PinholeModel pinhole;
  RadialTangentialModel::Coefficients coefficients{};
  if (const auto* plain = std::get_if<PinholeModel>(&model)) {
    pinhole = *plain;
  } else if (const auto* distorted = std::get_if<RadialTangentialModel>(&model)) {
    pinhole = distorted->pinhole();
    coefficients = distorted->coefficients();
  } else {
    return model;
  }
  const double x = std::max(pinhole.cx, size.width - 1 - pinhole.cx) / pinhole.fx;
  const double y = std::max(pinhole.cy, size.height - 1 - pinhole.cy) / pinhole.fy;
  const double radius = std::hypot(x, y);
  coefficients[0] += corner_px / (0.5 * (pinhole.fx + pinhole.fy) * radius * radius * radius);
  return RadialTangentialModel(pinhole, coefficients);
}

Eigen::Vector3d normal_vector(Random& random, double sigma) {
  return {random.normal(0, sigma), random.normal(0, sigma), random.normal(0, sigma)};
}

Camera& camera_of(Rig& rig, const std::string& name) {
  return *std::find_if(rig.cameras.begin(), rig.cameras.end(), [&](const Camera& c) { return c.name == name; });
}

void change_models(Rig& rig, const StereoPair& pair, const RoverErrorOptions& errors, Random& random) {
  const double common = 1 + 0.01 * random.normal(0, errors.focal_percent);
  for (const std::string& name : {pair.left, pair.right}) {
    Camera& camera = camera_of(rig, name);
    const double focal_factor = common * (1 + 0.01 * random.normal(0, errors.focal_difference_percent));
    Eigen::Vector2d centre_px{random.normal(0, errors.centre_px), random.normal(0, errors.centre_px)};
    const double rows_px = random.normal(0, errors.row_offset_px), corner_px = random.normal(0, errors.distortion_px);
    if (name == pair.right) centre_px.y() += rows_px;
    camera.model = with_distortion(with_errors(camera.model, focal_factor, centre_px), camera.size, corner_px);
  }
}

// The right camera relative to the left one.
void change_geometry(Rig& rig, const StereoPair& pair, const RoverErrorOptions& errors, Random& random) {
  const Eigen::Vector3d turn = normal_vector(random, errors.pair_rotation_deg * kRadiansPerDegree);
  const double stretch = 1 + 0.01 * random.normal(0, errors.baseline_percent);
  const Camera& left = camera_of(rig, pair.left);
  Camera& right = camera_of(rig, pair.right);
  const Eigen::Vector3d baseline = right.mount_from_camera.translation() - left.mount_from_camera.translation();
  right.mount_from_camera = Pose(right.mount_from_camera.rotation() * exp_so3(turn),
                                 left.mount_from_camera.translation() + stretch * baseline);
}

// A displacement of what is at `place` on the body, about that place.
Pose displacement(const Eigen::Vector3d& place, const RoverErrorOptions& errors, Random& random) {
  const Eigen::Vector3d turn = normal_vector(random, errors.mount_rotation_deg * kRadiansPerDegree);
  const Eigen::Vector3d shift = normal_vector(random, errors.mount_mm * 1e-3);
  return Pose::from_translation(place + shift) * Pose::from_rotation(exp_so3(turn)) * Pose::from_translation(-place);
}

}  // namespace

RoverErrorOptions rover_errors(RoverGrade grade) {
  switch (grade) {
    case RoverGrade::exact:
      break;
    case RoverGrade::ordinary:
      return {.pair_rotation_deg = 0.025,
              .baseline_percent = 0.1,
              .focal_percent = 0.1,
              .focal_difference_percent = 0.02,
              .centre_px = 0.15,
              .row_offset_px = 0.1,
              .distortion_px = 0.15,
              .mount_rotation_deg = 0.15,
              .mount_mm = 2,
              .pan_tilt_bias_deg = 0.1,
              .pan_tilt_noise_deg = 0.03,
              .drift_deg = 0.01,
              .gain_percent = 5};
    case RoverGrade::poor:
      return {.pair_rotation_deg = 0.08,
              .baseline_percent = 0.3,
              .focal_percent = 0.3,
              .focal_difference_percent = 0.06,
              .centre_px = 0.5,
              .row_offset_px = 0.3,
              .distortion_px = 0.5,
              .mount_rotation_deg = 0.5,
              .mount_mm = 6,
              .pan_tilt_bias_deg = 0.3,
              .pan_tilt_noise_deg = 0.1,
              .drift_deg = 0.04,
              .gain_percent = 15};
  }
  return {};
}

int jpeg_quality(RoverGrade grade) {
  constexpr std::array<int, 3> kQuality{0, 80, 60};
  return kQuality[static_cast<std::size_t>(grade)];
}

double camera_gain(const Rig& rig, const std::string& camera, const RoverErrorOptions& errors, int scenario_seed) {
  const auto at =
      std::find_if(rig.cameras.begin(), rig.cameras.end(), [&](const Camera& c) { return c.name == camera; });
  Random random(internal::rover_seed(errors, scenario_seed),
                kGainStream + static_cast<std::uint64_t>(at - rig.cameras.begin()));
  return std::max(0.01, 1 + 0.01 * random.normal(0, errors.gain_percent));
}

Rig nominal_rig(const Rig& rig, const NominalRigOptions& options) {
  Rig nominal = rig;
  for (const StereoPair& pair : rig.pairs) {
    for (Camera& camera : nominal.cameras) {
      const bool right = camera.name == pair.right;
      if (!right && camera.name != pair.left) continue;
      camera.model = with_errors(camera.model, 1 + options.focal_percent / 100, {0, right ? options.row_offset_px : 0});
      if (!right || options.yaw_deg == 0) continue;
      const Eigen::Quaterniond yaw(Eigen::AngleAxisd(options.yaw_deg * kRadiansPerDegree, Eigen::Vector3d::UnitY()));
      camera.mount_from_camera = camera.mount_from_camera * Pose::from_rotation(yaw);
    }
  }
  return nominal;
}

CalibrationErrors calibration_errors(const RoverErrorOptions& errors) {
  CalibrationErrors stated;
  stated.pair_rotation_deg = std::hypot(errors.pair_rotation_deg, errors.drift_deg);
  stated.scale_percent = std::hypot(errors.baseline_percent, errors.focal_percent);
  stated.mount_rotation_deg = errors.mount_rotation_deg;
  stated.mount_mm = errors.mount_mm;
  stated.pan_tilt_deg = std::hypot(errors.pan_tilt_bias_deg, errors.pan_tilt_noise_deg);
  return stated;
}

Rig true_rig(const Rig& rig, const RoverErrorOptions& errors, int scenario_seed) {
  if (errors == RoverErrorOptions{.seed = errors.seed}) return rig;  // bit for bit
  const std::uint64_t seed = internal::rover_seed(errors, scenario_seed);
  Rig changed = rig;
  std::set<std::string> done;  // a camera of two pairs has the errors of the first
  for (std::size_t i = 0; i < rig.pairs.size(); ++i) {
    const StereoPair& pair = rig.pairs[i];
    Random random(seed, kPairStream + i);
    const bool first = done.insert(pair.left).second, second = done.insert(pair.right).second;
    if (!first || !second) continue;
    change_models(changed, pair, errors, random);
    change_geometry(changed, pair, errors, random);
    if (camera_of(changed, pair.left).mount != "body") continue;
    const Pose moved = displacement(camera_of(changed, pair.left).mount_from_camera.translation(), errors, random);
    for (const std::string& name : {pair.left, pair.right}) {
      Camera& camera = camera_of(changed, name);
      camera.mount_from_camera = moved * camera.mount_from_camera;
    }
  }
  for (std::size_t i = 0; i < changed.pan_tilt_units.size(); ++i) {
    Random random(seed, kUnitStream + i);
    Pose& base = changed.pan_tilt_units[i].body_from_base;
    base = displacement(base.translation(), errors, random) * base;
  }
  return changed;
}

}  // namespace spartan::sim
